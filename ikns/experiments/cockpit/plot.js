// The whole profile, the pointer that crosses it, and the pointer's trail.
import { known } from "/link.js";

const INK = "#1d2430", SOFT = "#5a6472", LINE = "#e4e7eb", RED = "#d02f1c";

// Three canvases on top of each other, so that a frame is cheap on any machine: the grid
// with the curve is drawn once, and the trail is only extended.
export class Plot {
  constructor(holder, { big = false } = {}) {
    this.holder = holder;
    this.big = big;
    this.curve = this.shown = null;
    this.trail = [];
    this.drawn = 0;
    this.size = "";
    this.pens = ["grid", "trail", "pointer"].map((name) => {
      const canvas = document.createElement("canvas");
      canvas.className = name;
      holder.append(canvas);
      return canvas.getContext("2d");
    });
    this.dot = null;
  }

  begin(curve) {
    this.curve = curve.heights ? curve : null;
    this.trail = [];
    this.size = "";
  }

  // The plot area in pixels.
  box() {
    const { width, height } = this.holder.getBoundingClientRect();
    const side = this.big ? Math.max(44, 0.06 * width) : 34, end = this.big ? 26 : 14;
    return { left: side, right: width - (this.big ? side : 14), top: end, bottom: height - end, width, height };
  }

  share(y) {
    const box = this.box(), top = this.holder.getBoundingClientRect().top;
    return Math.min(1, Math.max(0, (box.bottom - (y - top)) / (box.bottom - box.top)));
  }

  // state: of the visit; trial: of the snapshot; c: the control signal.
  draw({ state, trial, c }) {
    const running = state === "align" || state === "track", box = this.box();
    this.X = (share) => box.left + share * (box.right - box.left);
    this.Y = (value) => box.bottom - (value / 100) * (box.bottom - box.top);
    this.fit(box, running);
    const [, trail, pointer] = this.pens;
    if (state === "track" && known(trial.y)) {
      const newest = this.trail[this.trail.length - 1];
      if (!newest || trial.x > newest[0]) this.trail.push([trial.x, trial.y]);
    }
    if (running && this.trail.length > this.drawn + 1) {
      this.stroke(trail, this.trail.slice(this.drawn).map(([x, y]) => [this.X(x), this.Y(y)]), RED);
      this.drawn = this.trail.length - 1;
    }
    if (this.dot) pointer.clearRect(this.dot[0] - 20, this.dot[1] - 20, 40, 40);
    // Between trials the pointer waits at the left and follows the signal.
    const y = running && known(trial.y) ? trial.y : known(c) ? 100 * Math.min(1, Math.max(0, c)) : null;
    this.dot = y === null ? null : [this.X(running ? trial.x : 0), this.Y(y)];
    if (this.dot) {
      pointer.beginPath();
      pointer.arc(...this.dot, this.big ? 13 : 6, 0, 2 * Math.PI);
      pointer.fillStyle = known(c) ? RED : "#fff";
      pointer.fill();
      pointer.lineWidth = this.big ? 3 : 2;
      pointer.strokeStyle = known(c) ? "#fff" : RED;
      pointer.stroke();
    }
  }

  // Redraw the grid if the size, the curve or the state has changed.
  fit(box, running) {
    const ratio = window.devicePixelRatio || 1;
    const size = `${box.width} ${box.height} ${ratio} ${running}`;
    if (size === this.size) return;
    this.size = size;
    this.drawn = 0;
    this.dot = null;
    for (const pen of this.pens) {
      pen.canvas.width = Math.round(box.width * ratio);
      pen.canvas.height = Math.round(box.height * ratio);
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.lineJoin = pen.lineCap = "round";
    }
    const [grid] = this.pens;
    grid.font = `${this.big ? 15 : 11}px system-ui, "DejaVu Sans", sans-serif`;
    grid.textAlign = "right";
    grid.textBaseline = "middle";
    grid.fillStyle = SOFT;
    for (const value of [0, 25, 50, 75, 100]) {
      this.stroke(grid, [[this.X(0), this.Y(value)], [this.X(1), this.Y(value)]], LINE, 1);
      grid.fillText(String(value), this.X(0) - (this.big ? 14 : 7), this.Y(value));
    }
    if (this.curve && running) {
      const heights = this.curve.heights, last = heights.length - 1;
      this.stroke(grid, heights.map((value, k) => [this.X(k / last), this.Y(value)]), INK);
    }
  }

  stroke(pen, points, color, width = this.big ? 4 : 2) {
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.beginPath();
    points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }
}
