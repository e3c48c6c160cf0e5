// @ts-check
"use strict";

/** @type {Record<string, [number, number]>} to the right and up */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] };

/** Moves over a map by keys: an arrow goes to the next rectangle, Enter picks it. */
class Walker {
  /** @param {string} panel @param {Plots} plots @param {Units} units */
  constructor(panel, plots, units) {
    this.panel = panel;
    this.plots = plots;
    this.units = units;
    /** @type {Cell[]} */
    this.cells = [];
    this.at = { x: 0, y: 0 };
    this.labels = { x: "", y: "" };
    this.shown = { x: "", y: "" };
  }

  /**
   * Move over other rectangles from now on.
   * @param {Cell[]} cells
   * @param {{x: string, y: string}} labels
   * @param {{x: string, y: string}} shown units of the table
   * @param {{x: number, y: number} | null} here where to begin; in the middle without it
   */
  over(cells, labels, shown, here) {
    [this.cells, this.labels, this.shown] = [cells, labels, shown];
    const middle = (/** @type {number[]} */ values) => values.sort((a, b) => a - b)[values.length >> 1] ?? 0;
    this.at = here ?? { x: middle(cells.map((cell) => cell.x)), y: middle(cells.map((cell) => cell.y)) };
    byId(`${this.panel}-at`).textContent = "";
  }

  /** @param {(cell: Cell) => void} pick */
  listen(pick) {
    byId(`figure-${this.panel}-map`).addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
      const arrow = ARROWS[event.key];
      if (arrow === undefined && event.key !== "Enter") return;
      event.preventDefault();
      if (this.cells.length === 0) return;
      if (arrow === undefined) pick(this.nearest());
      else this.move(arrow);
    });
  }

  /** @returns {Cell} the rectangle nearest to where the reader is */
  nearest() {
    const [wide, high] = [extent(this.cells.map((cell) => cell.x)), extent(this.cells.map((cell) => cell.y))];
    const far = (/** @type {Cell} */ cell) => Math.hypot((cell.x - this.at.x) / wide, (cell.y - this.at.y) / high);
    return this.cells.reduce((best, cell) => (far(cell) < far(best) ? cell : best));
  }

  /** @param {[number, number]} arrow */
  move([right, up]) {
    const from = this.nearest();
    const levels = (/** @type {"x" | "y"} */ axis) => [...new Set(this.cells.map((cell) => cell[axis]))].sort((a, b) => a - b);
    const next = (/** @type {"x" | "y"} */ axis, /** @type {number} */ step) => {
      const along = levels(axis);
      return along[Math.min(Math.max(along.indexOf(from[axis]) + step, 0), along.length - 1)];
    };
    this.at = { x: next("x", right), y: next("y", up) };
    const found = this.nearest();
    this.at = { x: found.x, y: found.y };
    const [sx, sy] = [this.units.size(this.shown.x), this.units.size(this.shown.y)];
    this.plots.fill(`${this.panel}-here`, { x: [found.x / sx], y: [found.y / sy] });
    const words = (/** @type {"x" | "y"} */ axis) => `${this.labels[axis]} ${this.units.text(found[axis], this.shown[axis])}`;
    const place = this.labels.y === "" ? words("x") : `${words("x")}, ${words("y")}`;
    byId(`${this.panel}-at`).textContent = `${place}: ${wordsOf(found)}`;
  }
}

/** @param {number[]} values @returns {number} how far they reach, never 0 */
function extent(values) {
  const [least, most] = values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  return most > least ? most - least : 1;
}
