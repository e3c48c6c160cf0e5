// @ts-check
"use strict";

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
