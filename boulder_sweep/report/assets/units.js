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
    return name === "" ? number(value) : `${number(value / this.size(unit))}${name === "°" ? "" : "\u00a0"}${name}`;
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
