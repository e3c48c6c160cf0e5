// @ts-check
"use strict";

/** Plays the motion of one design in its side view: one animation at a time, from where the reader left it. */
class Player {
  /**
   * @param {string} panel
   * @param {Float64Array} times of the samples [s]
   * @param {() => void} moved what to do when the slider has moved
   */
  constructor(panel, times, moved) {
    this.slider = byId(`${panel}-time`);
    this.button = byId(`${panel}-play`);
    this.times = times;
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

  /**
   * Take another motion.
   * @param {number} last its last sample
   * @param {number} sample shown first
   */
  load(last, sample) {
    this.pause();
    this.left = false;
    this.slider.max = last;
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
