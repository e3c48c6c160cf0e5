// @ts-check
"use strict";

/** Heights of maps and of strips [px]. */
const [MAP_HEIGHT, STRIP_HEIGHT] = [420, 170];

/** Size of what is written beside figures on the screen [px]. */
const WRITTEN = 13;

/** @param {Iterable<number>} times @returns {number[]} so rounded that the axis ends at 1, not a last bit before it */
function rounded(times) {
  return [...times].map((t) => Number(t.toPrecision(12)));
}

/** Bokeh's figures of the page, found by their names. */
class Plots {
  /** @param {{docs: any, items: any}} made what Python made */
  static async load(made) {
    Bokeh.set_log_level("error");
    await Bokeh.embed.embed_items(made.docs, made.items);
    return new Plots(Bokeh.documents.at(-1));
  }

  /** @param {any} document_ of Bokeh */
  constructor(document_) {
    this.document = document_;
  }

  /** @param {string} name @returns {any} a model of Bokeh */
  find(name) {
    return this.document.get_model_by_name(name);
  }

  /** Fill a source. @param {string} name @param {Record<string, any>} data columns */
  fill(name, data) {
    this.find(name).data = data;
  }

  /** Name the axes of a figure. @param {string} figure @param {string} x @param {string} y */
  title(figure, x, y) {
    this.find(`${figure}-x`).axis_label = x;
    this.find(`${figure}-y`).axis_label = y;
  }

  /** Write axes and legends in a size. @param {number} pixels */
  write(pixels) {
    const size = `${pixels}px`;
    for (const figure of this.document.roots()) {
      for (const part of [...figure.left, ...figure.below]) {
        if (part.type === "Legend") part.label_text_font_size = size;
        else part.axis_label_text_font_size = part.major_label_text_font_size = size;
      }
    }
  }

  /** Show a map as a strip if it has one input only. @param {string} panel @param {boolean} flat */
  flatten(panel, flat) {
    this.find(`${panel}-map-y`).visible = !flat;
    const map = this.find(`${panel}-map`);
    map.height = flat ? STRIP_HEIGHT : MAP_HEIGHT;
    const [verdict, across, up] = [["", "@verdict"], ["across", "@across{0.000a}"], ["up", "@up{0.000a}"]];
    this.find(`${panel}-map-hover`).tooltips = flat ? [verdict, across] : [verdict, across, up];
  }

  /**
   * Draw the motion of one design.
   * @param {string} panel
   * @param {Motion} motion
   * @param {Units} units
   * @param {number} limit of the rotation [rad]
   */
  draw(panel, motion, units, limit) {
    const { columns } = motion;
    /** @param {string} name @param {string} unit */
    const shown = (name, unit) => columns[name].map((value) => value / units.size(unit));
    this.fill(`${panel}-motion`, {
      time: rounded(motion.time),
      rotation: columns.theta_b.map((value) => value * DEGREES),
      limit: columns.theta_b.map(() => limit * DEGREES),
      boulder: shown("x_b", "m"),
      vehicle: shown("x_v", "m"),
      force: shown("F_v", "N"),
    });
    this.shade(panel, motion, limit, ["rotation", "displacement", "force"]);
    this.title(`${panel}-rotation`, "time [s]", "rotation [°]");
    this.title(`${panel}-displacement`, "time [s]", units.title("displacement", "m"));
    this.title(`${panel}-force`, "time [s]", units.title("contact force", "N"));
  }

  /**
   * Draw where the energy of one design goes, the figure that takes longest.
   * @param {string} panel
   * @param {Motion} motion
   * @param {Units} units
   * @param {string[]} parts of the energy
   * @param {number} limit of the rotation [rad]
   */
  drawEnergy(panel, motion, units, parts, limit) {
    const shown = parts.map((part) => [part, motion.columns[part].map((value) => value / units.size("J"))]);
    this.fill(`${panel}-energies`, { time: rounded(motion.time), ...Object.fromEntries(shown) });
    this.shade(panel, motion, limit, ["energy"]);
    this.title(`${panel}-energy`, "time [s]", units.title("energy", "J"));
  }

  /**
   * Shade the time after the limit, where the model no longer holds.
   * @param {string} panel
   * @param {Motion} motion
   * @param {number} limit of the rotation [rad]
   * @param {string[]} kinds of figures
   */
  shade(panel, motion, limit, kinds) {
    const over = motion.columns.theta_b.findIndex((value) => Math.abs(value) >= limit);
    const [left, right] = over < 0 ? [0, 0] : [motion.time[over], motion.time.at(-1)];
    for (const kind of kinds) this.find(`${panel}-${kind}-beyond`).setv({ left, right });
  }
}

/**
 * Rows of a table: a code for each design of a grid (the last axis fastest) or of a list; written by Python.
 * @typedef {object} TableRows
 * @property {string[]} names what a code stands for
 * @property {string[]} grades of the passes of each code by their robustness; empty words of others
 * @property {boolean} grid
 * @property {boolean} mapped whether anything varies
 * @property {Record<string, number[]>} values along each axis, or of each design of the list
 * @property {Record<string, number>} given inputs that are the same for all
 * @property {Record<string, string>} labels
 * @property {Record<string, string>} units
 * @property {Record<string, {names: string[], inputs: Record<string, number[]>}>} sets axes of named soils or vehicles
 * @property {string[]} first the axes of the map at first; empty for the usual ones
 * @property {string} asked of answers, the input that they are values of; empty for others
 * @property {string} codes
 */

/**
 * One rectangle of a map; `names` has all designs that lie there, `name` the worst of them, which is picked.
 * @typedef {{x: number, y: number, name: string, pick: () => Record<string, number>, names?: string[],
 *   answer?: string}} Cell
 */

/** Share by which values may differ that are the same but for their last digits. */
const ROUNDING = 1e-9;
/** Where the rectangles of a strip lie, which has one input only. */
const STRIP = 0.5;
/** Verdicts, from the best to the worst that a rectangle can show for designs that lie on each other. */
const WORSE = ["pass", "not computed yet", "undecided", "error", "fail"];

/** Sources of the hatched rectangles: passes that are not robust. @type {Record<string, string>} */
const HATCHES = { "pass: sensitive": "sensitive", "pass: open": "open" };

/** @param {string} name verdict and reason, or grade @returns {boolean} */
function isPass(name) {
  return name.split(":")[0] === "pass";
}

/**
 * The grade of a design by the table.
 * @param {TableRows} rows
 * @param {Uint8Array} codes
 * @param {Record<string, number>} design
 * @returns {string} empty where it is no row of the table, or does not pass there
 */
function gradeOf(rows, codes, design) {
  /** @type {Record<string, number>} */
  const known = { ...design, embedment_ratio: design.embedment_depth_m / design.boulder_height_m };
  const is = (/** @type {string} */ name, /** @type {number} */ value) => Math.abs(known[name] - value) <= ROUNDING * Math.abs(value);
  const names = Object.keys(rows.values);
  const lies = (/** @type {string} */ name, /** @type {number} */ place) => {
    const value = rows.values[name][place];
    if (!(name in rows.sets)) return is(name, value);
    return Object.entries(rows.sets[name].inputs).every(([one, own]) => is(one, own[value]));
  };
  if (!Object.entries(rows.given).every(([name, value]) => is(name, value))) return "";
  if (!rows.grid) return rows.grades[codes.find((_, row) => names.every((name) => lies(name, row))) ?? -1] ?? "";
  const places = names.map((name) => rows.values[name].findIndex((_, place) => lies(name, place)));
  if (places.includes(-1)) return "";
  return rows.grades[codes[names.reduce((at, name, k) => at * rows.values[name].length + places[k], 0)]];
}

/** Unpack what Python packed. @param {string} base64 */
async function unpacked(base64) {
  const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The ends of the intervals around ascending values, halfway between neighbours. @param {number[]} values */
function ends(values) {
  const inner = values.slice(1).map((value, k) => (value + values[k]) / 2);
  const [first, last] = [values[0], values[values.length - 1]];
  if (inner.length === 0) return [first - 0.05 * Math.abs(first) - 1e-9, last + 0.05 * Math.abs(last) + 1e-9];
  return [2 * first - inner[0], ...inner, 2 * last - inner[inner.length - 1]];
}

/** @type {Record<string, [number, number]>} to the right and up */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] };

/**
 * A map of verdicts over two inputs: its rectangles, its legend, and how the reader chooses a rectangle: by a click, or
 * by keys, of which an arrow goes to the next rectangle, and Enter picks it.
 */
class VerdictMap {
  /** @param {string} panel @param {Plots} plots @param {Units} units @param {Record<string, string>} colours by verdict */
  constructor(panel, plots, units, colours) {
    this.panel = panel;
    this.plots = plots;
    this.units = units;
    this.colours = colours;
    /** @type {Cell[]} */
    this.cells = [];
    /** Where the keys have gone. */
    this.at = { x: 0, y: 0 };
    this.labels = { x: "", y: "" };
    this.shown = { x: "", y: "" };
  }

  /**
   * Draw other rectangles.
   * @param {Cell[]} cells
   * @param {{x: string, y: string}} labels
   * @param {{x: string, y: string}} shown units of the table
   * @param {{x: number, y: number} | null} here the design shown elsewhere; keys begin there, or in the middle
   */
  draw(cells, labels, shown, here) {
    const { plots, panel, units } = this;
    [this.cells, this.labels, this.shown] = [cells, labels, shown];
    const [sx, sy] = [units.size(shown.x), units.size(shown.y)];
    /** @param {number[]} values */
    const steps = (values) => {
      const levels = [...new Set(values)].sort((a, b) => a - b);
      const limits = ends(levels);
      return new Map(levels.map((level, k) => [level, [limits[k], limits[k + 1]]]));
    };
    const [xs, ys] = [steps(cells.map((cell) => cell.x)), steps(cells.map((cell) => cell.y))];
    /** @param {Map<number, number[]>} map @param {number} value @param {number} end */
    const limit = (map, value, end) => /** @type {number[]} */ (map.get(value))[end];
    /** @param {Cell[]} some */
    const places = (some) => ({
      left: some.map((cell) => limit(xs, cell.x, 0) / sx),
      right: some.map((cell) => limit(xs, cell.x, 1) / sx),
      bottom: some.map((cell) => limit(ys, cell.y, 0) / sy),
      top: some.map((cell) => limit(ys, cell.y, 1) / sy),
    });
    for (const [name, hatched] of Object.entries(HATCHES)) {
      plots.fill(`${panel}-${hatched}`, places(cells.filter((cell) => cell.name === name)));
    }
    plots.fill(`${panel}-cells`, {
      ...places(cells),
      colour: cells.map((cell) => this.colourOf(cell.name)),
      verdict: cells.map(wordsOf),
      across: cells.map((cell) => cell.x / sx),
      up: cells.map((cell) => cell.y / sy),
    });
    plots.fill(`${panel}-here`, here === null ? { x: [], y: [] } : { x: [here.x / sx], y: [here.y / sy] });
    plots.flatten(panel, labels.y === "");
    plots.title(`${panel}-map`, units.title(labels.x, shown.x), units.title(labels.y, shown.y));
    const middle = (/** @type {number[]} */ values) => values.sort((a, b) => a - b)[values.length >> 1] ?? 0;
    this.at = here ?? { x: middle(cells.map((cell) => cell.x)), y: middle(cells.map((cell) => cell.y)) };
    byId(`${panel}-at`).textContent = "";
    this.drawLegend();
  }

  /** Count the rectangles of each colour beside it. */
  drawLegend() {
    /** @type {Map<string, number>} */
    const counts = new Map();
    for (const { name } of this.cells) counts.set(name, (counts.get(name) ?? 0) + 1);
    byId(`${this.panel}-legend`).replaceChildren(
      ...[...counts].sort().map(([name, count]) => {
        const item = element("li", "");
        const box = document.createElement("i");
        box.style.backgroundColor = this.colourOf(name);
        if (name in HATCHES) box.classList.add(HATCHES[name]);
        item.append(box, `${name.replaceAll("_", " ")} (${count.toLocaleString("en-US")})`);
        return item;
      }),
    );
  }

  /** @param {string} name verdict and reason @returns {string} */
  colourOf(name) {
    return this.colours[name] ?? this.colours[name.split(":")[0]] ?? this.colours.none;
  }

  /** Let the reader choose a rectangle, by a click or by keys. @param {(cell: Cell) => void} pick */
  listen(pick) {
    const source = this.plots.find(`${this.panel}-cells`);
    source.selected.properties.indices.change.connect(() => {
      const [picked] = source.selected.indices;
      if (picked === undefined) return;
      source.selected.indices = [];
      pick(this.cells[picked]);
    });
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

/** @param {Cell} cell @returns {string} its verdict, and whether other designs lie there */
function wordsOf(cell) {
  const words = `${cell.name.replaceAll("_", " ")}${cell.answer ?? ""}`;
  return (cell.names?.length ?? 1) > 1 ? `${words} (the worst of ${cell.names?.length} designs here)` : words;
}

/** @param {number} count @param {string} [of] @returns {string} how many designs pass, for a sentence */
function passes(count, of = "") {
  return `${count.toLocaleString("en-US")} ${of}${count === 1 ? "passes" : "pass"}`;
}

/** @param {Cell[]} cells @returns {string} how many designs pass, and whether some lie on each other */
function summed(cells) {
  const all = cells.flatMap((cell) => cell.names ?? [cell.name]);
  const passing = all.filter(isPass).length;
  const [total, places] = [all.length, cells.length].map((n) => n.toLocaleString("en-US"));
  const first = `${passes(passing, `of the ${total} designs shown `)}.`;
  if (all.length === cells.length) return first;
  return `${first} Designs lie on each other: the map has ${places} ${cells.length === 1 ? "place" : "places"}, each shown as the worst of its designs.`;
}

/**
 * One rectangle for all designs that lie at the same place, as the worst of them.
 * @param {Cell[]} cells
 * @returns {Cell[]}
 */
function merged(cells) {
  const worse = (/** @type {Cell} */ cell) => WORSE.indexOf(cell.name.split(":")[0]) + (cell.name in HATCHES ? 0.5 : 0);
  /** @type {Map<string, Cell>} */
  const places = new Map();
  for (const cell of cells) {
    const place = `${cell.x} ${cell.y}`;
    const known = places.get(place);
    const names = known?.names ?? [];
    names.push(cell.name);
    if (known === undefined || worse(cell) > worse(known)) places.set(place, { ...cell, names });
  }
  return [...places.values()];
}

/**
 * The cells of a table over two of its inputs, the others held.
 * @param {TableRows} rows
 * @param {Uint8Array} codes
 * @param {string} across
 * @param {string} up empty for a single strip
 * @param {Record<string, number>} held place along every other axis
 * @returns {Cell[]}
 */
function tableCells(rows, codes, across, up, held) {
  const names = Object.keys(rows.values);
  if (!rows.grid) {
    // Columns that follow from others differ in their last digits.
    const at = (/** @type {string} */ name, /** @type {number} */ row) => Number(rows.values[name][row].toPrecision(12));
    return merged(
      [...codes].map((code, row) => ({
        x: at(across, row),
        y: up === "" ? STRIP : at(up, row),
        name: rows.names[code],
        pick: () => Object.fromEntries(names.map((name) => [name, rows.values[name][row]])),
      })),
    );
  }
  const lengths = names.map((name) => rows.values[name].length);
  const strides = lengths.map((_, k) => lengths.slice(k + 1).reduce((a, b) => a * b, 1));
  const [i, j] = [names.indexOf(across), names.indexOf(up)];
  const base = names.reduce((sum, name, k) => sum + (k === i || k === j ? 0 : held[name] * strides[k]), 0);
  return merged(
    rows.values[across].flatMap((x, a) =>
      (up === "" ? [STRIP] : rows.values[up]).map((y, b) => ({
        x,
        y,
        name: rows.names[codes[base + a * strides[i] + (up === "" ? 0 : b * strides[j])]],
        pick: () =>
          Object.fromEntries(names.map((name) => [name, name === across ? x : name === up ? y : rows.values[name][held[name]]])),
      })),
    ),
  );
}

/** @param {number[]} values @returns {number} how far they reach, never 0 */
function extent(values) {
  const [least, most] = values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  return most > least ? most - least : 1;
}
