"use strict";
// Numbers travel as base64 of little-endian arrays (ikns/view/scene/page.py).
const KINDS = { f4: Float32Array, u4: Uint32Array, u1: Uint8Array };
const revive = (_, value) => {
  if (value === null || typeof value !== "object" || value.$ === undefined) return value;
  const bytes = Uint8Array.from(atob(value.data), (c) => c.charCodeAt(0));
  return new KINDS[value.$](bytes.buffer);
};
const find = (id) => document.getElementById(id);
const scene = JSON.parse(find("scene").textContent, revive);
// A picture is drawn once and has nothing to press.
const picture = location.hash === "#picture";
document.body.classList.toggle("picture", picture);
// In the experimenter's panel, whose place is small.
const embedded = window.parent !== window;
document.body.classList.toggle("embedded", embedded);

let viewer;
try {
  viewer = new MeshCat.Viewer(find("pane"), !picture);
} catch (error) {
  find("fault").textContent = "This page draws with WebGL, which this browser does not offer.";
  find("fault").hidden = false;
  throw error;
}
for (const command of scene.commands) viewer.handle_command(command);
// The thorax stands upright at the origin of three.js, whose Y is up as the thorax's is.
viewer.camera.fov = scene.fov;
viewer.camera.position.set(...scene.camera);
viewer.controls.target.set(...scene.target);
// Room for the ground below.
viewer.controls.target.y -= 0.04;
// MeshCat takes the height of the window, also when the window changes; the pane is less.
const size = viewer.set_3d_pane_size.bind(viewer);
viewer.set_3d_pane_size = () => {
  const { clientWidth: width, clientHeight: height } = find("pane");
  // The angle of view is the vertical one, and the ground with its labels is wider than the
  // body: it reaches 1.25 times as far from the middle as half of a square picture.
  viewer.camera.zoom = Math.min(0.92, (0.75 * width) / Math.max(1, height));
  size(width, Math.max(1, height));
};
viewer.set_3d_pane_size();
viewer.controls.update();
if (!picture) new ResizeObserver(() => viewer.set_3d_pane_size()).observe(find("pane"));

// Arrow keys turn the view, as dragging does: rad around, and rad up or down.
const TURNS = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
find("pane").addEventListener("keydown", (event) => {
  const turn = TURNS[event.key];
  if (!turn) return;
  event.preventDefault();
  const { target } = viewer.controls, way = viewer.camera.position.clone().sub(target), far = way.length();
  const around = Math.atan2(way.x, way.z) + turn[0];
  const down = Math.min(3.0, Math.max(0.1, Math.acos(way.y / far) + turn[1]));
  way.set(far * Math.sin(down) * Math.sin(around), far * Math.cos(down), far * Math.sin(down) * Math.cos(around));
  viewer.camera.position.copy(target).add(way);
  viewer.controls.update();
  viewer.set_dirty();
});

// A small window, such as the one in the experimenter's panel, is left to the body.
find("legend").open = picture || (innerHeight >= 500 && innerWidth >= 760 && !embedded);
for (const layer of scene.layers) {
  const item = document.createElement("li"), label = document.createElement("label");
  const box = document.createElement("input"), dot = document.createElement("i");
  box.type = "checkbox";
  box.checked = layer.shown;
  dot.style.background = layer.color;
  const show = () => {
    for (const path of layer.paths)
      viewer.handle_command({ type: "set_property", path, property: "visible", value: box.checked });
    item.classList.toggle("off", !box.checked);
  };
  box.addEventListener("change", show);
  show();
  label.append(box, dot, layer.name);
  item.append(label);
  find("legend").lastElementChild.append(item);
}

const animator = viewer.animator, slider = find("time");
const tell = (time, values) => {
  find("clock").textContent = time === null ? "" : `${time.toFixed(2)} s`;
  for (const line of document.querySelectorAll(".curve i")) line.style.left = `${(100 * time) / slider.max}%`;
  scene.signals.forEach((name, k) => {
    const c = values[k];
    find(name).textContent = c === null || Number.isNaN(c) ? `${name} unknown` : `${name} = ${c.toFixed(2)}`;
    find(`${name}_gauge`).firstElementChild.style.width = `${100 * Math.min(1, Math.max(0, c || 0))}%`;
  });
};
// Value of a signal at a time, on the line between its neighbors.
const signalAt = (time, values) => {
  const { times } = scene;
  let low = 0, high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle; else high = middle;
  }
  const width = times[high] - times[low];
  return width > 0 ? values[low] + ((values[high] - values[low]) * (time - times[low])) / width : values[low];
};
const seek = (time) => {
  animator.seek(time);
  animator.display_progress(time);
};
const play = (on) => {
  if (on) animator.play(); else animator.pause();
  find("play").textContent = on ? "\u275A\u275A" : "\u25B6";
  find("play").setAttribute("aria-label", on ? "Pause" : "Play");
};
// A curve over the whole time, from 0 to a top; a click or a drag goes to that time. What
// is far beyond leaves the picture, as a line along its edge would look like a plateau.
const draw = (holder, values, top) => {
  const last = scene.times[scene.times.length - 1], points = [];
  let pen = "M";
  values.forEach((value, k) => {
    if (Number.isNaN(value)) { pen = "M"; return; }
    const y = 100 * (1 - Math.min(99, Math.max(-99, value / top)));
    points.push(`${pen}${((1000 * scene.times[k]) / last).toFixed(1)} ${y.toFixed(1)}`);
    pen = "L";
  });
  holder.innerHTML = `<svg viewBox="0 -15 1000 130" preserveAspectRatio="none" aria-hidden="true"><rect width="1000" height="100"/><path d="${points.join("")}"/></svg><b>${top}</b><b>0</b><i></i>`;
  const go = (event) => {
    const box = holder.getBoundingClientRect();
    play(false);
    seek(last * Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)));
  };
  holder.addEventListener("pointerdown", (event) => { holder.setPointerCapture(event.pointerId); go(event); });
  holder.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
};
const curves = () => {
  scene.signals.forEach((name, k) => draw(find(`${name}_curve`), scene.c[k], 1));
  const speeds = Array.from(scene.speed).filter(Number.isFinite), most = Math.max(0, ...speeds);
  document.body.classList.toggle("still", most === 0);
  // The next of 0.1, 0.2, 0.5, 1, 2, ... holds all.
  const power = 10 ** Math.floor(Math.log10(most || 1));
  if (most) draw(find("speed_curve"), scene.speed, Number(([1, 2, 5].find((x) => x * power >= most) * power || 10 * power).toPrecision(1)));
};
if (scene.times.length > 1) {
  find("player").hidden = false;
  slider.max = scene.times[scene.times.length - 1];
  curves();
  // Only an action that was started once follows the slider.
  play(true);
  play(false);
  seek(scene.start);
  slider.addEventListener("input", () => { play(false); seek(Number(slider.value)); });
  find("play").addEventListener("click", () => play(!animator.playing));
  document.addEventListener("keydown", (event) => {
    if (event.code === "Space" && event.target === document.body) play(!animator.playing);
  });
  const follow = () => {
    slider.value = animator.time;
    tell(animator.time, scene.c.map((values) => signalAt(animator.time, values)));
    const speed = scene.speed.length ? signalAt(animator.time, scene.speed) : NaN;
    find("speed").textContent = Number.isNaN(speed) ? "" : `${speed.toFixed(2)} m/s`;
    if (!picture) requestAnimationFrame(follow);
  };
  follow();
}
if (scene.live) {
  find("player").hidden = false;
  find("player").classList.add("live");
  const frames = new EventSource(scene.live);
  frames.onmessage = (event) => {
    const frame = JSON.parse(event.data, revive);
    for (const command of frame.commands) viewer.handle_command(command);
    tell(frame.time, frame.c);
  };
}
if (picture) {
  viewer.set_3d_pane_size();
  // A canvas is emptied whenever it gets its size, an image stays.
  const image = document.createElement("img");
  image.src = viewer.capture_image();
  image.id = "image";
  find("pane").replaceChildren(image);
}
