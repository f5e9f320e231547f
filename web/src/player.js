// A slider with a button that plays it to its end, and from there once more.
import { byId } from "./elements.js";

export class Player {
  constructor(slider, button, milliseconds, chosen) {
    Object.assign(this, { slider, button, milliseconds, chosen });
    slider.addEventListener("input", () => {
      this.#stop();
      chosen(Number(slider.value));
    });
    button.addEventListener("click", () => this.toggle());
  }

  show(value, most, words) {
    this.slider.max = Math.max(most, 0);
    this.slider.value = value;
    this.slider.setAttribute("aria-valuetext", words);
    this.slider.disabled = this.button.disabled = most < 1;
    if (most < 1) this.#stop();
    byId(`${this.slider.id}-shown`).textContent = words;
  }

  step(by) {
    const next = Number(this.slider.value) + by;
    if (!this.slider.disabled && next >= 0 && next <= Number(this.slider.max)) this.chosen(next);
  }

  toggle() {
    if (this.slider.disabled) return;
    if (this.timer) return this.#stop();
    if (Number(this.slider.value) >= Number(this.slider.max)) this.chosen(0);
    this.timer = setInterval(() => {
      this.step(1);
      if (Number(this.slider.value) >= Number(this.slider.max)) this.#stop();
    }, this.milliseconds);
    this.button.setAttribute("aria-pressed", "true");
  }

  #stop() {
    clearInterval(this.timer);
    this.timer = undefined;
    this.button.setAttribute("aria-pressed", "false");
  }
}
