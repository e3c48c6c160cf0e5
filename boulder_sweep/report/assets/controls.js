// @ts-check
"use strict";

/**
 * @typedef {{name: string, section: string, key: string, label: string, unit: string, low: number, high: number,
 *   from: number, to: number, usual: [number, number, string] | null}} Input
 */

/** @param {string} id @returns {any} */
const byId = (id) => document.getElementById(id);

/**
 * An element with text; never markup, whatever the text.
 * @param {string} tag
 * @param {string} text
 * @param {string} [kind] its class
 */
function element(tag, text, kind = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  made.className = kind;
  return made;
}

/** The sliders and boxes of the simulator. */
class Controls {
  /** @param {Input[]} inputs @param {Units} units @param {boolean} face whether the impact height follows from Eq 9 */
  constructor(inputs, units, face) {
    this.inputs = inputs;
    this.units = units;
    this.face = face;
    /** @type {Record<string, number>} the design that is simulated */
    this.shown = {};
  }

  /** @param {(name: string, value: number) => void} changed what to do with a new value, in the unit of the table */
  listen(changed) {
    for (const input of this.inputs) {
      const box = byId(`in-${input.name}`);
      const admitted = (/** @type {number} */ value) => Math.min(Math.max(value, input.low), input.high);
      const typed = (/** @type {any} */ place) => place.valueAsNumber * this.units.size(input.unit);
      for (const place of [byId(`slide-${input.name}`), box]) {
        place.addEventListener("input", () => {
          const value = typed(place);
          this.say(input, "");
          if (!Number.isFinite(value)) return;
          changed(input.name, admitted(value));
          // Slider and box have six digits.
          if (Math.abs(admitted(value) - value) > 1e-5 * Math.abs(value)) this.say(input, `limited to ${this.range(input)}`);
        });
      }
      // Whoever leaves the box sees what is simulated.
      const settle = () => {
        const value = typed(box);
        if (admitted(value) === value) return;
        if (!Number.isFinite(value)) this.say(input, "not a number");
        box.value = this.digits(input);
      };
      for (const kind of ["change", "blur"]) box.addEventListener(kind, settle);
    }
  }

  /** @param {Input} input @returns {string} the value that is simulated, for its box */
  digits(input) {
    return String(Number((this.shown[input.name] / this.units.size(input.unit)).toPrecision(6)));
  }

  /** @param {Input} input @returns {string} what is admitted */
  range(input) {
    return `${number(input.low / this.units.size(input.unit))} to ${this.units.text(input.high, input.unit)}`;
  }

  /** @param {Input} input @param {string} why another value is simulated than the one that was typed; empty if it is not */
  say(input, why) {
    const words = why === "" ? "" : `${why}: ${this.units.text(this.shown[input.name], input.unit)} is simulated`;
    byId(`limited-${input.name}`).textContent = words;
  }

  /** @param {Record<string, number>} design by the columns of the table */
  show(design) {
    this.shown = design;
    for (const input of this.inputs) {
      const size = this.units.size(input.unit);
      const [slide, box] = [byId(`slide-${input.name}`), byId(`in-${input.name}`)];
      const value = design[input.name];
      slide.min = Math.min(input.from, value) / size;
      slide.max = Math.max(input.to, value) / size;
      slide.value = value / size;
      slide.setAttribute("aria-valuetext", this.units.text(value, input.unit));
      if (document.activeElement !== box) box.value = this.digits(input);
      this.say(input, "");
      const name = this.units.name(input.unit);
      const place = box.closest(".control");
      place.querySelector(".unit").textContent = name === "" ? "" : `[${name}]`;
      place.classList.toggle("unusual", this.unusual(input, value));
      if (input.name === "impact_height_m") slide.disabled = box.disabled = this.face;
    }
    byId("face-hint").textContent = this.face ? "The impact height follows from the other heights (Eq 9)." : "";
    this.showFlags(design);
  }

  /** @param {Input} input @param {number} value */
  unusual(input, value) {
    return input.usual !== null && (value < input.usual[0] * (1 - 1e-9) || value > input.usual[1] * (1 + 1e-9));
  }

  /** @param {Record<string, number>} design */
  showFlags(design) {
    const flags = this.inputs.filter((input) => this.unusual(input, design[input.name]));
    byId("flags").replaceChildren(
      ...flags.map((input) => {
        const [low, high, remark] = /** @type {[number, number, string]} */ (input.usual);
        const range = `${number(low / this.units.size(input.unit))} to ${this.units.text(high, input.unit)}`;
        return element("li", `${input.label}: outside the usual ${range} (${remark})`);
      }),
    );
  }
}
