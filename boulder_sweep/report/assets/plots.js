// @ts-check
"use strict";

/** Heights of curves and of the line of a legend, of maps and of strips [px]. */
const [HEIGHT, LEGEND_LINE, MAP_HEIGHT, STRIP_HEIGHT] = [240, 20, 420, 170];

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
    const views = await Bokeh.embed.embed_items(made.docs, made.items);
    void views;
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

  /**
   * Fill a source.
   * @param {string} name
   * @param {Record<string, any>} data columns
   */
  fill(name, data) {
    this.find(name).data = data;
  }

  /**
   * Name the axes of a figure.
   * @param {string} figure
   * @param {string} x
   * @param {string} y
   */
  title(figure, x, y) {
    this.find(`${figure}-x`).axis_label = x;
    this.find(`${figure}-y`).axis_label = y;
  }

  /** Give text, axes and grids the colours of the page. */
  recolour() {
    const style = getComputedStyle(document.documentElement);
    const [text, line] = ["--text", "--line"].map((name) => style.getPropertyValue(name).trim());
    for (const figure of this.document.roots()) {
      for (const axis of [...figure.left, ...figure.below].filter((part) => part.type !== "Legend")) {
        axis.axis_label_text_color = axis.major_label_text_color = text;
        axis.axis_line_color = axis.major_tick_line_color = axis.minor_tick_line_color = line;
      }
      for (const part of figure.center) if (part.type === "Grid") part.grid_line_color = line;
      for (const part of [...figure.right, ...figure.below]) {
        if (part.type !== "Legend") continue;
        part.label_text_color = text;
        part.background_fill_color = part.border_line_color = null;
      }
    }
  }

  /** Write axes and legends in a size. @param {number} pixels */
  write(pixels) {
    const size = `${pixels}px`;
    for (const figure of this.document.roots()) {
      for (const part of [...figure.left, ...figure.below, ...figure.right]) {
        if (part.type === "Legend") part.label_text_font_size = size;
        else part.axis_label_text_font_size = part.major_label_text_font_size = size;
      }
    }
  }

  /**
   * Put legends below their figures, or beside them where the screen has room.
   * @param {boolean} narrow
   */
  place(narrow) {
    for (const figure of this.document.roots()) {
      const legends = (/** @type {any[]} */ parts) => parts.filter((part) => part.type === "Legend");
      for (const legend of legends(figure.right)) legend.visible = !narrow;
      for (const legend of legends(figure.below)) {
        legend.visible = narrow;
        figure.height = HEIGHT + (narrow ? LEGEND_LINE * (legend.items.length + 1) : 0);
      }
    }
  }

  /**
   * Show a map as a strip if it has one input only.
   * @param {string} panel
   * @param {boolean} flat
   */
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
