// Input of the participant with gamepad, keyboard or mouse: c of 0 to 1, or null.

const UP = ["ArrowUp", "KeyW"], DOWN = ["ArrowDown", "KeyS"];
// Full range in 2 s: the fastest profile falls by 47 of 100 in 1 s.
const RATE = 0.5;

export class Hands {
  constructor(plot, { onBegin, onPress, onStop }) {
    this.plot = plot;
    this.stick = "left";
    this.keys = new Set();
    this.value = 0;
    this.mouse = null;
    this.before = performance.now();
    this.first = false;
    this.onBegin = onBegin;
    window.addEventListener("keydown", (event) => {
      if (event.code === "Escape") onStop();
      if (event.repeat) return;
      this.ramp();
      this.keys.add(event.code);
      if (event.code === "Space") onPress();
      if (event.code === "Enter") onBegin();
      if ([...UP, ...DOWN, "Space"].includes(event.code)) event.preventDefault();
    });
    const release = (event) => {
      this.ramp();
      if (event.code) this.keys.delete(event.code); else this.keys.clear();
    };
    window.addEventListener("keyup", release);
    // A window without the focus gets no keyup.
    window.addEventListener("blur", release);
    window.addEventListener("pointermove", (event) => { this.mouse = plot.share(event.clientY); });
    document.addEventListener("mouseleave", () => { this.mouse = null; });
  }

  pad() {
    return [...navigator.getGamepads()].find((pad) => pad && pad.connected) ?? null;
  }

  // Move the value as the keys were held until now.
  ramp() {
    const now = performance.now(), held = (keys) => keys.some((key) => this.keys.has(key));
    const change = (RATE * (now - this.before) * (held(UP) - held(DOWN))) / 1000;
    this.value = Math.min(1, Math.max(0, this.value + change));
    this.before = now;
  }

  // Signal of a condition; to be called at a steady rate, whatever the condition.
  c(condition) {
    this.ramp();
    const pad = this.pad(), first = Boolean(pad?.buttons[0]?.pressed);
    if (first && !this.first) this.onBegin();
    this.first = first;
    if (condition === "keyboard") return this.value;
    if (condition === "mouse") return this.mouse;
    if (condition !== "gamepad" || pad === null) return null;
    // Up is negative on a stick; its middle is 0, its upper end 1.
    const raw = this.stick === "trigger" ? (pad.buttons[7]?.value ?? null) : pad.axes.length > 1 ? -pad.axes[1] : null;
    return raw === null ? null : Math.min(1, Math.max(0, raw));
  }
}
