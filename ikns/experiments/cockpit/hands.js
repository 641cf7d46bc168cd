// What the participant's hands do with gamepad, keyboard or mouse: c of 0 to 1, or null.

const UP = ["ArrowUp", "KeyW"], DOWN = ["ArrowDown", "KeyS"];
// From one end to the other in 2 s: the fastest fall that is drawn goes 47 of 100 in 1 s.
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
    const free = (event) => {
      this.ramp();
      if (event.code) this.keys.delete(event.code); else this.keys.clear();
    };
    window.addEventListener("keyup", free);
    // Whoever looks elsewhere has let go of the keys.
    window.addEventListener("blur", free);
    window.addEventListener("pointermove", (event) => { this.mouse = plot.share(event.clientY); });
    document.addEventListener("mouseleave", () => { this.mouse = null; });
  }

  pad() {
    return [...navigator.getGamepads()].find((pad) => pad && pad.connected) ?? null;
  }

  // Move on as the keys were held until now.
  ramp() {
    const now = performance.now(), held = (keys) => keys.some((key) => this.keys.has(key));
    const change = (RATE * (now - this.before) * (held(UP) - held(DOWN))) / 1000;
    this.value = Math.min(1, Math.max(0, this.value + change));
    this.before = now;
  }

  // To be called all the time, whatever drives.
  c(by) {
    this.ramp();
    const pad = this.pad(), first = Boolean(pad?.buttons[0]?.pressed);
    if (first && !this.first) this.onBegin();
    this.first = first;
    if (by === "keyboard") return this.value;
    if (by === "mouse") return this.mouse;
    if (by !== "gamepad" || pad === null) return null;
    // Up is negative on a stick; its middle is 0, its upper end 1, as on the desk's own.
    const raw = this.stick === "trigger" ? (pad.buttons[7]?.value ?? null) : pad.axes.length > 1 ? -pad.axes[1] : null;
    return raw === null ? null : Math.min(1, Math.max(0, raw));
  }
}
