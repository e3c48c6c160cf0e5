// @ts-check
"use strict";

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
