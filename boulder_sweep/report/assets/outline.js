// @ts-check
"use strict";

/**
 * Points of an outline from the foot up: height over the foot, width, and reach towards the vehicle and away from it,
 * linear in between; in metres, or as shares of height, width and length.
 * @typedef {[number, number, number, number][]} Outline
 */

/** Columns of an outline beside the height. */
const [WIDTH, NEAR, FAR] = [1, 2, 3];
/** @type {Outline} */
const BOX = [[0, 1, 0.5, 0.5], [1, 1, 0.5, 0.5]];

/**
 * The outline of a boulder of a design: `boulder_sweep.soils.outlines_of`.
 * @param {Outline} profile as shares; without points that of a box
 * @param {{H: number, W: number, L: number}} sides [m]
 * @returns {Outline}
 */
function outlineOf(profile, { H, W, L }) {
  const shares = profile.length > 0 ? profile : BOX;
  return shares.map(([height, width, near, far]) => [height * H, width * W, near * L, far * L]);
}

/** @param {Outline} outline @param {number} column @param {number} z height over the foot [m] @returns {number} */
function atHeight(outline, column, z) {
  return interpolated(outline.map(([height]) => height), outline.map((point) => point[column]), z);
}

/**
 * How far a boulder reaches from where it is struck to its far face, where that is farthest [m].
 * @param {Outline} outline
 * @param {number} blow height of the blow over the foot [m]
 */
function reachOf(outline, blow) {
  return atHeight(outline, NEAR, blow) + Math.max(...outline.map((point) => point[FAR]));
}

/**
 * The faces of a boulder from the side, from the foot up: x from where it is struck, z over the foot [m].
 * @param {Outline} outline
 * @param {number} blow height of the blow over the foot [m]
 * @returns {{near: [number, number][], far: [number, number][]}}
 */
function facesOf(outline, blow) {
  const struck = atHeight(outline, NEAR, blow);
  return {
    near: outline.map(([z, , near]) => [struck - near, z]),
    far: outline.map(([z, , , far]) => [struck + far, z]),
  };
}

/**
 * Layers cut into slices in which a law that depends on the width takes that of their middle:
 * `boulder_sweep.soils.beside_outlines`.
 * @param {number[]} layers six numbers for each, from the top down
 * @param {string} law
 * @param {KernelDesign} design
 * @param {Outline} outline
 * @param {number} slices of the buried depth
 * @returns {number[]}
 */
function inSlices(layers, law, design, outline, slices) {
  const { d } = design;
  const given = Array.from({ length: layers.length / 6 }, (_, m) => layers.slice(6 * m, 6 * m + 6));
  const cuts = Array.from({ length: slices - 1 }, (_, k) => (d * (k + 1)) / slices);
  const bottoms = [...given.map(([to]) => to), ...cuts].sort((a, b) => a - b);
  return bottoms.flatMap((bottom, m) => {
    const top = m > 0 ? bottoms[m - 1] : 0;
    const [, rho_s, phi, beta, pressure, slope] = given.find(([to]) => to > top) ?? given[given.length - 1];
    const middle = 0.5 * (Math.min(top, d) + Math.min(bottom, d));
    const local = resistanceFactor(law, { ...design, phi, W: atHeight(outline, WIDTH, d - middle) });
    const factor = local / resistanceFactor(law, { ...design, phi });
    return [bottom, rho_s, phi, beta, factor * pressure, factor * slope];
  });
}
