// @ts-check
"use strict";

/**
 * @typedef {{name: string, section: string, key: string, label: string, unit: string, low: number, high: number,
 *   reason: string, needed: string, above: [number, string] | null, from: number, to: number,
 *   usual: [number, number, string] | null}} Input `above`: what a value must be more than, and what is said otherwise
 */
/**
 * What is said of the value of an input that a settings file is refused for; written by Python.
 * @typedef {{outside: string, empty: string, not_a_number: string}} Refused
 */

/** Values that differ by less are the same in the six digits of a box. */
const SIX_DIGITS = 1e-5;

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

/**
 * Fill the places of a template, as Python's `str.format` does.
 * @param {string} template
 * @param {Record<string, string>} values
 */
function filled(template, values) {
  return template.replace(/\{(\w+)\}/g, (_, name) => values[name]);
}

/** The sliders and boxes of the simulator. */
class Controls {
  /** @param {any} data of the page @param {Units} units */
  constructor(data, units) {
    /** @type {Input[]} */
    this.inputs = data.inputs;
    this.units = units;
    /** Whether the impact height follows from Eq 9. @type {boolean} */
    this.face = data.face;
    /** Inputs that cannot be moved. @type {string[]} */
    this.fixed = [...data.boulder.fixed, ...(data.face ? ["impact_height_m"] : [])];
    /** @type {Refused} */
    this.words = data.refused;
    /** Why what stands in the box of an input is refused, by its name. @type {Record<string, string>} */
    this.refused = {};
    /** @type {Record<string, number>} the design that was simulated last */
    this.shown = {};
  }

  /** @param {(given: Record<string, number>) => void} changed what to do with new values, in the units of the table */
  listen(changed) {
    for (const input of this.inputs) {
      const box = byId(`in-${input.name}`);
      for (const place of [byId(`slide-${input.name}`), box]) {
        place.addEventListener("input", () => {
          const { value, why } = this.read(input, place);
          delete this.refused[input.name];
          if (why !== "") this.refused[input.name] = why;
          changed(why === "" ? { [input.name]: value } : {});
        });
      }
      // Whoever leaves the box sees what is simulated; what is refused stays.
      box.addEventListener("blur", () => {
        if (!(input.name in this.refused)) box.value = this.digits(input);
      });
    }
  }

  /**
   * Read a slider or a box as the command reads an entry of a file.
   * @param {Input} input @param {any} place
   * @returns {{value: number, why: string}} the value in the unit of the table, or why it is refused
   */
  read(input, place) {
    const value = place.valueAsNumber * this.units.size(input.unit);
    if (!Number.isFinite(value)) {
      const wrong = place.validity.badInput ? this.words.not_a_number : this.words.empty;
      return { value: NaN, why: `${wrong}; ${input.needed}` };
    }
    const admitted = Math.min(Math.max(value, input.low), input.high);
    const written = (/** @type {number} */ one) => this.units.written(one, input.unit);
    if (Math.abs(admitted - value) > SIX_DIGITS * Math.abs(value)) {
      const low = sixDigits(input.low / this.units.size(input.unit));
      const values = { value: written(value), low, high: written(input.high), reason: input.reason };
      return { value: NaN, why: filled(this.words.outside, values) };
    }
    if (input.above !== null && admitted <= input.above[0]) return { value: NaN, why: filled(input.above[1], { value: written(value) }) };
    return { value: admitted, why: "" };
  }

  /** @param {Input} input @returns {string} the value that was simulated last, for its box */
  digits(input) {
    return sixDigits(this.shown[input.name] / this.units.size(input.unit));
  }

  /** Say beside the boxes what is refused. @param {Record<string, string>} why by the names of the inputs */
  say(why) {
    for (const { name } of this.inputs) {
      byId(`refused-${name}`).textContent = why[name] ?? "";
      byId(`in-${name}`).setAttribute("aria-invalid", String(name in why));
    }
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
      if (document.activeElement !== box && !(input.name in this.refused)) box.value = this.digits(input);
      const name = this.units.name(input.unit);
      const place = box.closest(".control");
      place.querySelector(".unit").textContent = name === "" ? "" : `[${name}]`;
      place.classList.toggle("unusual", this.unusual(input, value));
      slide.disabled = box.disabled = this.fixed.includes(input.name);
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
    const words = flags.map((input) => {
      const [low, high, remark] = /** @type {[number, number, string]} */ (input.usual);
      const range = `${number(low / this.units.size(input.unit))} to ${this.units.text(high, input.unit)}`;
      return `${input.label}: outside the usual ${range} (${remark})`;
    });
    byId("flags").replaceChildren(...words.map((one) => element("li", one)));
  }
}

/** The two lists that the axes of a map are chosen from. Choosing what the other holds exchanges them. */
class Axes {
  /** @param {string} across @param {string} up ids of the lists */
  constructor(across, up) {
    this.lists = [byId(across), byId(up)];
    this.chosen = ["", ""];
  }

  get across() {
    return this.chosen[0];
  }

  /** Empty where only one input varies. */
  get up() {
    return this.chosen[1];
  }

  /**
   * @param {[string, string][]} options names and words
   * @param {string} first
   * @param {string} second empty if there is none
   */
  offer(options, first, second) {
    this.chosen = [first, second];
    this.lists.forEach((list, k) => {
      list.replaceChildren(...options.map(([value, words]) => Object.assign(element("option", words), { value })));
      list.value = this.chosen[k];
    });
    this.lists[1].parentElement.hidden = second === "";
  }

  /** @param {() => void} changed */
  listen(changed) {
    this.lists.forEach((list, k) =>
      list.addEventListener("change", () => {
        const other = this.lists[1 - k];
        if (other.value === list.value) other.value = this.chosen[k];
        this.chosen = this.lists.map((one) => one.value);
        changed();
      }),
    );
  }
}

/** Plays the motion of one design in its side view: one animation at a time, from where the reader left it. */
class Player {
  /** @param {string} panel @param {() => void} moved what to do when the slider has moved */
  constructor(panel, moved) {
    this.slider = byId(`${panel}-time`);
    this.button = byId(`${panel}-play`);
    /** @type {Float64Array} of the samples [s] */
    this.times = new Float64Array(0);
    this.moved = moved;
    /** The frame that the browser was asked for; 0 at rest. */
    this.frame = 0;
    /** Whether the reader has put the slider where it is. */
    this.left = false;
  }

  listen() {
    this.slider.addEventListener("input", () => {
      this.pause();
      this.moved();
    });
    this.button.addEventListener("click", () => (this.frame === 0 ? this.play() : this.pause()));
  }

  /** Take another motion. @param {Float64Array} times of its samples [s] @param {number} sample shown first */
  load(times, sample) {
    this.pause();
    this.left = false;
    this.times = times;
    this.slider.max = Math.max(times.length - 1, 0);
    this.slider.value = sample;
  }

  pause() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.left = true;
    this.button.textContent = "Play";
  }

  /** Go on from where the reader left the slider, or begin. */
  play() {
    const last = Number(this.slider.max);
    if (last === 0) return;
    const from = this.left ? Number(this.slider.value) % last : 0;
    // Five times as slow as it is.
    const rate = last / this.times[last] / 5000;
    const begun = performance.now() - from / rate;
    /** @param {number} now */
    const tick = (now) => {
      const sample = Math.min(Math.max(Math.floor((now - begun) * rate), from), last);
      this.slider.value = String(sample);
      this.moved();
      if (sample < last) this.frame = requestAnimationFrame(tick);
      else this.pause();
    };
    this.button.textContent = "Pause";
    this.frame = requestAnimationFrame(tick);
  }
}

/**
 * For every unit of the table, the unit to show in each system, and its size in the unit of the table; written by Python.
 * @typedef {Record<string, Record<string, [string, number]>>} UnitTable
 */

/** Turns numbers of the table into what people read, in one of two systems of units. */
class Units {
  /** @param {UnitTable} table @param {string} system si or us */
  constructor(table, system) {
    this.table = table;
    this.system = system;
  }

  /** @param {string} unit of the table @returns {number} value in it of one unit shown */
  size(unit) {
    return this.table[unit]?.[this.system][1] ?? 1;
  }

  /** @param {string} unit of the table @returns {string} the unit shown, as a settings file has it */
  plain(unit) {
    return this.table[unit]?.[this.system][0] ?? unit;
  }

  /** @param {string} unit of the table @returns {string} the unit shown */
  name(unit) {
    const plain = this.plain(unit);
    if (plain === "1" || plain === "") return "";
    return plain.replace("deg", "°").replace("^3", "³").replace("*", "·");
  }

  /**
   * A number with its unit.
   * @param {number | string | null} value in the unit of the table
   * @param {string} unit of the table
   * @param {number} [up] of a depth: 1 if it is rounded up, as on the command line, -1 if down
   */
  text(value, unit, up = 0) {
    if (value === null) return "–";
    if (typeof value === "string") return value;
    const name = this.name(unit);
    return name === "" ? number(value) : `${up ? this.rounded(value, unit, up) : this.bare(value, unit)}${name === "°" ? "" : "\u00a0"}${name}`;
  }

  /**
   * A value as a settings file and its messages have it.
   * @param {number} value in the unit of the table
   * @param {string} unit of the table
   * @param {number} [digits]
   */
  written(value, unit, digits = 6) {
    const plain = this.plain(unit);
    return `${sixDigits(value / this.size(unit), digits)}${plain === "1" ? "" : ` ${plain}`}`;
  }

  /** @param {number} value @param {string} unit of the table @param {number} up see `text` @returns {string} a depth that is not less, or not more, than the value */
  rounded(value, unit, up) {
    return ((up * Math.ceil(((up * value) / this.size(unit)) * 1000 - 1e-6)) / 1000).toFixed(3);
  }

  /** @param {number | string | null} value @param {string} unit of the table @returns {string} a number without its unit */
  bare(value, unit) {
    if (typeof value !== "number") return value ?? "–";
    const shown = value / this.size(unit);
    // Nobody measures a boulder or its bed more finely than to the hundredth of a foot.
    return number(this.plain(unit) === "ft" && Math.abs(shown) >= 0.1 ? Number(shown.toFixed(2)) : shown);
  }

  /** @param {string} words @param {string} unit of the table @returns {string} a title for an axis */
  title(words, unit) {
    const name = this.name(unit);
    return name === "" ? words : `${words} [${name}]`;
  }
}

/** A number for reading: four digits that count, thousands apart. @param {number} value */
function number(value) {
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "–";
  if (value !== 0 && Math.abs(value) < 1e-3) return value.toLocaleString("en-US", { maximumSignificantDigits: 2 });
  return Number(value.toPrecision(Math.abs(value) >= 1e4 ? 5 : 4)).toLocaleString("en-US", { maximumFractionDigits: 9 });
}

/** A number of at most six digits, as Python's format `g` writes it. @param {number} value @param {number} [digits] */
function sixDigits(value, digits = 6) {
  const [figures, power] = value.toExponential(digits - 1).split("e");
  if (Number(power) >= -4 && Number(power) < digits) return String(Number(value.toPrecision(digits)));
  return `${Number(figures)}e${power[0]}${power.slice(1).padStart(2, "0")}`;
}

/** @param {number} share @returns {string} */
function percent(share) {
  return `${(100 * share).toFixed(1)} %`;
}

/**
 * A design as a file of settings, in the units shown and to six digits.
 * @param {any} data of the page
 * @param {Record<string, number>} design
 * @param {Units} units
 * @returns {string}
 */
function yamlOf(data, design, units) {
  /** @type {Record<string, string[]>} */
  const sections = {};
  for (const { name, section, key, unit } of /** @type {Input[]} */ (data.inputs)) {
    if (name === "impact_height_m" && data.face) continue;
    if (name === "boulder_density_kg_m3" && data.boulder.rock_assumed) continue;
    if (data.boulder.fixed.includes(name)) continue;
    (sections[section] ??= []).push(`${key}: ${units.written(design[name], unit)}`);
  }
  const { boulder, vehicle, soil, lines } = data.yaml[units.system];
  const [H, W, L] = ["height", "width", "length"].map((side) => design[`boulder_${side}_m`]);
  const points = outlineOf(data.boulder.profile, { H, W, L }).map((point) => {
    const entries = ["height", "width", "near", "far"].map((key, k) => `${key}: ${units.written(point[k], "m")}`);
    return `{${entries.join(", ")}}`;
  });
  sections.boulder.push(...boulder);
  if (data.boulder.fixed.length > 0) sections.boulder.push(`profile: [${points.join(", ")}]`);
  sections.vehicle.push(...vehicle);
  sections.soil.push(...soil);
  return [
    `name: ${JSON.stringify(data.title)}`,
    ...Object.entries(sections).map(([section, entries]) => `${section}: {${entries.join(", ")}}`),
    ...lines,
    "",
  ].join("\n");
}

/**
 * Rows as comma-separated values, every field in quotes.
 * @param {string[]} names
 * @param {Record<string, any>[]} rows
 * @returns {string}
 */
function csvOf(names, rows) {
  const quoted = (/** @type {any} */ value) => `"${String(value ?? "").replaceAll('"', '""')}"`;
  return [names.join(","), ...rows.map((row) => names.map((name) => quoted(row[name])).join(",")), ""].join("\n");
}

/** @param {string} text @param {string} name of the file */
function download(text, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}
