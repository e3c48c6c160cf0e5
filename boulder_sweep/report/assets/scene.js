// @ts-check
"use strict";

/**
 * What a side view shows of a design; SI.
 * @typedef {{outline: Outline, depth: number, blow: number, friction: number, mass: number,
 *   speed: number, spring: number, damper: number, bumper: number, hood: number, bed: number, line: number,
 *   rating: string}} Scene
 */

const SVG = "http://www.w3.org/2000/svg";
const LONGEST_ARROW = 1.5;

/** A drawing of truck, boulder and soil from the side, in metres: x in the direction of travel, y up from the soil. */
class SideView {
  /** @param {SVGSVGElement} svg */
  constructor(svg) {
    this.svg = svg;
  }

  /** Draw one sample of a motion. @param {Scene} s @param {Motion} motion @param {number} sample */
  draw(s, motion, sample) {
    this.svg.replaceChildren();
    const slope = Math.tan(Math.PI / 4 + s.friction / 2);
    const { near, far } = facesOf(s.outline, s.depth + s.blow);
    const corners = [...far, ...near.reverse()];
    const [reach, height] = [0, 1].map((k) => Math.max(...far.map((corner) => corner[k])));
    const [left, right] = [-(s.bed + 1.6), Math.max(reach + s.depth * slope, s.line + 2.8) + 0.4];
    const [bottom, top] = [-s.depth - 0.4, Math.max(height - s.depth, 2.6) + 0.7];
    this.svg.setAttribute("viewBox", `${left} ${-top} ${right - left} ${top - bottom}`);
    /** @param {string} name */
    const at = (name) => (motion.time.length > 0 ? motion.columns[name][sample] : 0);
    const [x_b, theta, x_v] = ["x_b", "theta_b", "x_v"].map(at);

    this.shape("soil", [[left - 50, bottom - 50], [right + 50, bottom - 50], [right + 50, 0], [left - 50, 0]]);
    /** @type {(corner: [number, number]) => [number, number]} a point of the boulder, from where it is struck, over its foot */
    const place = ([x, y]) => {
      const [u, v, sin, cos] = [x - motion.c_x, y - motion.c_y, Math.sin(theta), Math.cos(theta)];
      return [motion.c_x + x_b + u * cos + v * sin, motion.c_y - s.depth - u * sin + v * cos];
    };
    // The soil that moves with the boulder: along its buried far face, and as much farther as it lies over the foot.
    const [struck, soilLine] = [far[0][0] - s.outline[0][FAR], Math.min(s.depth, height)];
    /** @type {[number, number][]} */
    const buried = [...far.filter(([, z]) => z < soilLine), [struck + atHeight(s.outline, FAR, soilLine), soilLine]];
    const beyond = buried.map((corner) => {
      const [x, y] = place(corner);
      return /** @type {[number, number]} */ ([x + corner[1] * slope, y]);
    });
    this.shape("wedge", [...buried.map(place), ...beyond.reverse()]);
    this.shape("first", corners.map(([x, z]) => [x, z - s.depth]));
    this.shape("boulder", corners.map(place));
    this.line("limit", [s.line, 0], [s.line, 2.5]);
    const words = [`${s.rating}: limit`, "of the", "cargo bed"]; // short lines: there is little room behind the limit
    words.forEach((line, k) => this.text("limit", s.line + 0.08, 2.5 - 0.46 * k, line));
    this.truck(s, x_v, motion.time.length > 0 ? at("v_v") : s.speed, at("F_v"));

    const peak = Math.max(0, ...(motion.columns.F_v ?? []));
    const force = at("F_v");
    if (force > 0.02 * peak) {
      const head = place([0, s.blow + s.depth]);
      this.arrow("force", [head[0] - (LONGEST_ARROW * force) / peak, head[1]], head);
    }
  }

  /**
   * A truck whose front is shorter by its crush: by what the damper keeps, and by what the spring gives back.
   * @param {Scene} s
   * @param {number} x displacement
   * @param {number} v speed
   * @param {number} force of contact
   */
  truck(s, x, v, force) {
    const crush = Math.max((s.mass / s.damper) * (s.speed - v) + force / s.spring, 0);
    const zone = Math.min(Math.max(1.7, crush / 0.75), s.bed);
    /** @type {(behind: number, y: number) => [number, number]} */
    const at = (behind, y) => [x - behind - Math.min(crush, 0.75 * zone) * (1 - Math.min(behind / zone, 1)), y];
    const roof = Math.max(s.hood + 0.85, 2.2);
    const back = Math.max(s.bed - 0.25, zone);
    this.shape("truck", [at(back, 0.7), at(back, 1.05), at(s.bed + 6, 1.05), at(s.bed + 6, 0.7)]);
    this.shape("bed", [at(s.bed, 1.05), at(s.bed, 2.3), at(s.bed + 6, 2.3), at(s.bed + 6, 1.05)]);
    this.shape("truck", [
      at(0, s.bumper), at(0, s.hood - 0.25), at(0.15, s.hood), at(0.38 * back, s.hood + 0.05),
      at(0.55 * back, roof), at(back, roof), at(back, s.bumper),
    ]);
    this.shape("window", [
      at(0.46 * back, s.hood + 0.1), at(0.57 * back, roof - 0.15), at(0.85 * back, roof - 0.15), at(0.85 * back, s.hood + 0.1),
    ]);
    this.line("edge", at(s.bed, 0.75), at(s.bed, 2.45));
    for (const behind of [0.36 * back, s.bed + 3.2]) {
      const [cx, cy] = at(behind, 0.42);
      this.add("circle", "wheel", { cx, cy: -cy, r: 0.42 });
    }
  }

  /** @param {string} kind @param {[number, number][]} points */
  shape(kind, points) {
    this.add("polygon", kind, { points: points.map(([x, y]) => `${x},${-y}`).join(" ") });
  }

  /** @param {string} kind @param {[number, number]} a @param {[number, number]} b */
  line(kind, a, b) {
    this.add("line", kind, { x1: a[0], y1: -a[1], x2: b[0], y2: -b[1] });
  }

  /** @param {string} kind @param {[number, number]} a @param {[number, number]} b */
  arrow(kind, a, b) {
    this.line(kind, a, b);
    const size = Math.min(0.18, b[0] - a[0]);
    this.shape(`${kind} head`, [b, [b[0] - size, b[1] + 0.5 * size], [b[0] - size, b[1] - 0.5 * size]]);
  }

  /** @param {string} kind @param {number} x @param {number} y @param {string} words */
  text(kind, x, y, words) {
    this.add("text", kind, { x, y: -y }).textContent = words;
  }

  /** @param {string} tag @param {string} kind @param {Record<string, string | number>} attributes */
  add(tag, kind, attributes) {
    const element = document.createElementNS(SVG, tag);
    element.setAttribute("class", kind);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
    return this.svg.appendChild(element);
  }
}
