// Input of the participant with gamepad, keyboard or mouse: c of 0 to 1, or null.

const UP = ["ArrowUp", "KeyW"], DOWN = ["ArrowDown", "KeyS"];
// Full range in 2 s: the fastest profile falls by 47 of 100 in 1 s.
const RATE = 0.5;
// A control that changes by more was moved; sticks at rest tremble by less.
const MOVED = 0.15;
// An axis is chosen when it travels this far of its two units, and comes back to within
// BACK of where it was before.
const TRAVEL = 0.6, BACK = 0.2;
// So many readings without a change, a quarter of a second, are rest.
const IDLE = 15, STILL = 0.05;
// What is read of a gamepad of the standard mapping, by the name of the option: up is
// negative on a stick; its middle is 0. See https://www.w3.org/TR/gamepad/#remapping.
const CONTROLS = {
  left: { name: "left stick", read: (pad) => (pad.axes.length > 1 ? -pad.axes[1] : NaN) },
  trigger: { name: "right trigger", read: (pad) => pad.buttons[7]?.value ?? NaN },
};

const clip = (value) => (Number.isFinite(value) ? Math.min(1, Math.max(0, value)) : null);
const standard = (pad) => pad.mapping === "standard";

// One axis of a gamepad whose layout is unknown: where it turned round so far.
class Track {
  constructor(first) {
    this.turns = [first];
    this.last = this.farthest = first;
    this.direction = this.idle = 0;
  }

  add(value) {
    this.idle = Math.abs(value - this.last) < STILL ? this.idle + 1 : 0;
    if (!this.idle) this.last = value;
    const step = (value - this.farthest) * this.direction;
    if (this.direction === 0) {
      if (Math.abs(value - this.farthest) > BACK) this.direction = Math.sign(value - this.farthest);
      if (this.direction) this.farthest = value;
    } else if (step > 0) {
      this.farthest = value;
    } else if (step < -BACK) {
      this.turns.push(this.farthest);
      this.turns.splice(0, this.turns.length - 20);
      this.direction *= -1;
      this.farthest = value;
    }
  }

  // The ends of the axis once it was pushed all the way and let go; null before.
  ends(value) {
    // A rest at an end is known at once. In the middle it may be one on the way, or the 0
    // that some browsers report until an axis is first moved: then it must stay there.
    const [first] = this.turns, atOnce = Math.abs(first) > 1 - BACK && Math.abs(value - first) < STILL;
    if (!atOnce && this.idle < IDLE) return null;
    for (const [k, before] of this.turns.entries()) {
      if (Math.abs(before - value) > BACK) continue;
      const far = this.turns.slice(k + 1).reduce((a, b) => (Math.abs(b - value) > Math.abs(a - value) ? b : a), value);
      if (Math.abs(far - value) > TRAVEL) return { rest: value, end: far };
    }
    return null;
  }
}

// The axis of such a gamepad that the user chose by moving it. Its end is the farthest
// value that was seen.
class Axis {
  constructor() {
    this.tracks = [];
    this.chosen = null;
  }

  read({ axes }) {
    this.chosen ??= this.choose(axes);
    if (this.chosen === null) return NaN;
    const { k, rest, end } = this.chosen, value = axes[k];
    if ((value - end) * (end - rest) > 0) this.chosen.end = value;
    return (value - rest) / (this.chosen.end - rest);
  }

  choose(axes) {
    let chosen = null;
    axes.forEach((value, k) => {
      if (!Number.isFinite(value)) return;
      const track = (this.tracks[k] ??= new Track(value));
      track.add(value);
      const ends = track.ends(value), travel = ends ? Math.abs(ends.end - ends.rest) : 0;
      if (travel > Math.abs((chosen?.end ?? 0) - (chosen?.rest ?? 0))) chosen = { k, ...ends };
    });
    return chosen;
  }

  get name() {
    const { k, rest, end } = this.chosen;
    return `axis ${k} from ${rest.toFixed(2)} to ${end.toFixed(2)} (C chooses another)`;
  }
}

// All gamepads; the one is read whose control moved last.
class Pads {
  constructor() {
    this.known = new Map();
    this.taken = null;
    this.text = "";
  }

  // Forget the axes that were chosen.
  forget() {
    for (const state of this.known.values()) if (state.axis) state.axis = new Axis();
  }

  // Read all gamepads: {pad, value} of the one in use, or null.
  poll(stick) {
    const found = this.devices(), control = CONTROLS[stick] ?? CONTROLS.left;
    this.drop(found);
    for (const [key, pad] of found) this.look(key, pad, control);
    const usable = [...this.known].filter(([, state]) => Number.isFinite(state.value));
    if (this.taken === null && usable.length === 1 && usable[0][1].fresh) this.taken = usable[0][0];
    this.text = this.describe(control, usable.length);
    const state = this.known.get(this.taken);
    return state ? { pad: found.get(this.taken), value: state.value } : null;
  }

  // Devices without axes are no gamepads, and those without buttons are motion sensors.
  devices() {
    const list = [...(navigator.getGamepads?.() ?? [])], found = new Map();
    list.forEach((pad, k) => {
      if (!pad?.connected || !pad.axes.length || !pad.buttons.length) return;
      found.set([pad.index ?? k, pad.id, pad.mapping, pad.axes.length, pad.buttons.length].join("|"), pad);
    });
    return found;
  }

  drop(found) {
    for (const key of [...this.known.keys()]) {
      if (found.has(key)) continue;
      this.known.delete(key);
      if (key !== this.taken) continue;
      // No other one takes its place until it is moved.
      this.taken = null;
      for (const state of this.known.values()) state.fresh = false;
    }
  }

  look(key, pad, control) {
    const state = this.known.get(key) ?? { at: 0, pressed: false, fresh: true, axis: standard(pad) ? null : new Axis() };
    this.known.set(key, state);
    state.id = (pad.id ?? "").split("(")[0].trim().slice(0, 40) || "The gamepad";
    state.value = (state.axis ?? control).read(pad);
    const pressed = standard(pad) && pad.buttons.some((button) => button.pressed);
    const moved = Math.abs(state.value - state.at) > MOVED;
    if (moved) state.at = state.value;
    const usable = Number.isFinite(state.value);
    if (usable && (moved || (pressed && !state.pressed))) this.taken = key;
    state.pressed = pressed;
    if (!usable && this.taken === key) this.taken = null;
  }

  describe(control, usable) {
    const states = [...this.known.values()], taken = this.known.get(this.taken);
    if (taken) return `${taken.id}: ${taken.axis?.name ?? control.name}`;
    if (!navigator.getGamepads) return "This browser hands out no gamepads here: open the page on this machine itself";
    if (usable) return "Move the control of the gamepad to use";
    const odd = states.find((state) => state.axis);
    if (odd) return `${odd.id} is not understood: push the control to use all the way and let it go`;
    if (states.length) return `${states[0].id} has no ${control.name}`;
    return "No gamepad yet: press one of its buttons";
  }
}

export class Hands {
  constructor(plot, { onBegin, onPress, onStop }) {
    this.plot = plot;
    this.stick = "left";
    this.keys = new Set();
    this.value = 0;
    this.mouse = null;
    this.before = performance.now();
    this.pads = new Pads();
    this.first = false;
    this.onBegin = onBegin;
    window.addEventListener("keydown", (event) => {
      if (event.code === "Escape") onStop();
      if (event.repeat) return;
      this.ramp();
      this.keys.add(event.code);
      if (event.code === "Space") onPress();
      if (event.code === "Enter") onBegin();
      if (event.code === "KeyC") this.pads.forget();
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

  // Which gamepad and control are read, or what to do for one.
  get gamepad() {
    return this.pads.text;
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
    const taken = this.pads.poll(this.stick);
    // Of another mapping, no button is known to be the first.
    const first = Boolean(taken && standard(taken.pad) && taken.pad.buttons[0].pressed);
    if (first && !this.first) this.onBegin();
    this.first = first;
    if (condition === "keyboard") return this.value;
    if (condition === "mouse") return this.mouse;
    return condition === "gamepad" && taken ? clip(taken.value) : null;
  }
}
