// @ts-check
"use strict";

/**
 * For every unit of the table, the unit to show in each system, and its value in that of the table; written by Python.
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

  /** @param {string} unit of the table @returns {string} the unit shown */
  name(unit) {
    const plain = this.table[unit]?.[this.system][0] ?? unit;
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
    return name === "" ? number(value) : `${number(value / this.size(unit))}${name === "°" ? "" : "\u00a0"}${name}`;
  }

  /** @param {number | string | null} value @param {string} unit of the table @returns {string} a number without its unit */
  bare(value, unit) {
    return typeof value === "number" ? number(value / this.size(unit)) : (value ?? "–");
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

/** @param {number} share @returns {string} */
function percent(share) {
  return `${(100 * share).toFixed(1)} %`;
}
