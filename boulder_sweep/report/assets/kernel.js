// @ts-check
"use strict";

/**
 * Names of the numbers that the kernel takes and gives, each in its order, how many numbers a layer of soil has, and how
 * many the kernel makes of it, of a piece beside an outline, and of a soil element; written by Python.
 * @typedef {{design: string[], settings: string[], outcome: string[], history: string[], sizes: string[],
 *   flag_inputs: string[], course: string[], layer: number, piece_room: number, element_room: number, sums_room: number}} Layout
 */

/**
 * The soil of all designs as it lies, numbers in the kernel's order: what holds for all of it, null for a water table out
 * of reach, and the deeper layers; points of the profile of boulders that are no boxes; and how many deeper layers and
 * points there are, and how many layers the kernel makes of them. Written by Python.
 * @typedef {{ground: (number | null)[], below: number[], profile: number[], deeper: number, points: number,
 *   layers: number}} Soil
 */

/**
 * A design in the kernel's terms and units (SI, rad): numbers by the names of `Layout.design`.
 * @typedef {Record<string, number>} KernelDesign
 */

/**
 * @typedef {object} Motion
 * @property {Float64Array} time
 * @property {Record<string, Float64Array>} columns by the names of `Layout.history`; the samples that were reached
 * @property {number} c_x centre of mass of boulder and soil, from where the boulder is struck and over its foot [m]
 * @property {number} c_y
 */

/** Room for a call: two addresses, and the numbers of the longer record. */
const CALL = 2 + 24;

/** The compiled kernels. Every call writes its arguments into the module's memory and reads the results there. */
class Kernel {
  /** @param {WebAssembly.Instance} instance @param {Layout} layout @param {Soil} soil */
  constructor(instance, layout, soil) {
    /** @type {any} */
    this.exports = instance.exports;
    this.layout = layout;
    this.soil = soil;
    this.exports._initialize();
    /** Where the memory is free; `call` takes the first places. */
    this.base = Math.ceil(this.exports.__heap_base.value / 8) * 8;
  }

  /** @param {string} packed the module @param {Layout} layout @param {Soil} soil */
  static async load(packed, layout, soil) {
    const { instance } = await WebAssembly.instantiate(await unpacked(packed));
    return new Kernel(instance, layout, soil);
  }

  /**
   * Lay arrays one behind the other into the memory.
   * @param {number[]} lengths
   * @returns {{at: number[], views: Float64Array[]}} their addresses, and views of them
   */
  room(lengths) {
    const memory = this.exports.memory;
    let next = this.base;
    const at = lengths.map((length) => {
      const here = next;
      next += 8 * length;
      return here;
    });
    const lacking = next - memory.buffer.byteLength;
    if (lacking > 0) memory.grow(Math.ceil(lacking / 65536));
    return { at, views: lengths.map((length, i) => new Float64Array(memory.buffer, at[i], length)) };
  }

  /**
   * @param {number[]} settings in the order of `Layout.settings`
   * @param {number} n designs
   * @returns {number[]} lengths of the arrays for the soil: what is given, and room for layers, outlines and their numbers
   */
  soilLengths(settings, n) {
    const { layer, piece_room, element_room, sums_room } = this.layout;
    const { ground, below, profile, points, layers } = this.soil;
    const elements = settings[this.layout.settings.indexOf("elements")];
    const room = Math.max(sums_room + piece_room * (layers + points), element_room * elements);
    return [ground.length, below.length, profile.length, layer * layers * n, 4 * points * n, room];
  }

  /**
   * Write the soil, and return the arguments of an exported function for it.
   * @param {number[]} at addresses of the arrays of `soilLengths`
   * @param {Float64Array[]} views of them
   */
  soilArguments(at, views) {
    const { ground, below, profile, deeper, points, layers } = this.soil;
    views[0].set(ground.map((one) => one ?? Infinity));
    views[1].set(below);
    views[2].set(profile);
    return [at[0], at[1], deeper, at[2], points, at[3], layers, at[4], at[5]];
  }

  /**
   * Call an exported function with the address of its record. Before that, compiled Python takes the addresses of a
   * result and of an exception; none of ours uses them, and what it returns is 0 where all went well.
   * @param {string} name
   * @param {number[]} values the numbers and addresses of the record
   */
  call(name, values) {
    const record = this.base + 16;
    new Float64Array(this.exports.memory.buffer, record, values.length).set(values);
    const status = this.exports[name](this.base, this.base + 8, record);
    if (status !== 0) throw new Error(`the kernel ended with status ${status}`);
  }

  /**
   * Simulate designs, and apply the rules of the verdict.
   * @param {KernelDesign[]} designs
   * @param {Record<string, number>[]} inputs the same designs by the columns of the table
   * @param {number[][]} controls settings in the order of `Layout.settings`, each finer than those before it
   * @param {number[]} limits of the criterion, and what the model was tested on
   * @returns {Record<string, Float64Array>} one number for each design by the names of `Layout.outcome` and
   *   `Layout.course`, and its `flags`; `decided_by` is the number of the settings that decided
   */
  rows(designs, inputs, controls, limits) {
    const { design, outcome, sizes, flag_inputs, course } = this.layout;
    const n = designs.length;
    const results = outcome.length * n;
    const { at, views } = this.room([
      CALL, design.length * n, ...this.soilLengths(controls[0], n), controls.flat().length, sizes.length * n,
      flag_inputs.length * n, limits.length, results, 3 * results, 2 * course.length * n, n,
    ]);
    design.forEach((name, field) => designs.forEach((one, row) => (views[1][field * n + row] = one[name])));
    views[8].set(controls.flat());
    views[9].set(inputs.flatMap((one) => sizes.map((name) => one[name])));
    views[10].set(inputs.flatMap((one) => flag_inputs.map((name) => one[name])));
    views[11].set(limits);
    const soil = this.soilArguments(at.slice(2, 8), views.slice(2, 8));
    this.call("rows", [at[1], n, ...soil, at[8], controls.length, ...at.slice(9)]);
    const reached = outcome.map((name, field) => [name, views[12].slice(field * n, (field + 1) * n)]);
    const judged = course.map((name, field) => [
      name, Float64Array.from({ length: n }, (_, row) => views[14][row * course.length + field]),
    ]);
    return Object.fromEntries([...reached, ...judged, ["flags", views[15].slice()]]);
  }

  /**
   * Simulate one design over time.
   * @param {KernelDesign} one
   * @param {number[]} settings in the order of `Layout.settings`
   * @param {Float64Array} times ascending [s]
   * @returns {Motion}
   */
  history(one, settings, times) {
    const { design, history } = this.layout;
    const n = times.length;
    const { at, views } = this.room([
      CALL, design.length, ...this.soilLengths(settings, 1), settings.length, n, 6 * n, 2 * n, 4 * n,
      history.length * n, 2,
    ]);
    design.forEach((name, field) => (views[1][field] = one[name]));
    views[8].set(settings);
    views[9].set(times);
    this.call("history", [at[1], ...this.soilArguments(at.slice(2, 8), views.slice(2, 8)), at[8], n, ...at.slice(9)]);
    const [found, centre] = views.slice(-2);
    const end = found.subarray(0, n).findIndex(Number.isNaN);
    const reached = end < 0 ? n : end;
    return {
      time: times.slice(0, reached),
      columns: Object.fromEntries(history.map((name, k) => [name, found.slice(k * n, k * n + reached)])),
      c_x: centre[0],
      c_y: centre[1],
    };
  }
}
