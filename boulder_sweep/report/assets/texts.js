// @ts-check
"use strict";

/**
 * For every unit of the table, the unit to show in each system, and its size in the unit of the table; written by Python.
 * @typedef {Record<string, Record<string, [string, number]>>} UnitTable
 */

/** Turns numbers of the table into what people read, in one of two systems of units. */
class Units {
  /**
   * @param {UnitTable} table
   * @param {string} system si or us
   */
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
   */
  text(value, unit) {
    if (value === null) return "–";
    if (typeof value === "string") return value;
    const name = this.name(unit);
    return name === "" ? number(value) : `${this.bare(value, unit)}${name === "°" ? "" : "\u00a0"}${name}`;
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

/**
 * A number for reading: four digits that count, thousands apart.
 * @param {number} value
 */
function number(value) {
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "–";
  if (value !== 0 && Math.abs(value) < 1e-3) return value.toLocaleString("en-US", { maximumSignificantDigits: 2 });
  return Number(value.toPrecision(Math.abs(value) >= 1e4 ? 5 : 4)).toLocaleString("en-US", { maximumFractionDigits: 9 });
}

/**
 * A number of at most six digits, as Python's format `g` writes it.
 * @param {number} value
 * @param {number} [digits]
 */
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
