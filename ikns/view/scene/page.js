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
if (!picture) {
  // Room for the player below.
  viewer.controls.target.y -= 0.04;
  viewer.camera.position.sub(viewer.controls.target).multiplyScalar(1.12).add(viewer.controls.target);
}
viewer.controls.update();

// A small window, such as the one in the experimenter's panel, is left to the body.
find("legend").open = picture || innerHeight >= 500;
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
const tell = (time, c) => {
  find("clock").textContent = time === null ? "" : `${time.toFixed(2)} s`;
  find("c").textContent = c === null || Number.isNaN(c) ? "c unknown" : `c = ${c.toFixed(2)}`;
  find("gauge").firstElementChild.style.width = `${100 * Math.min(1, Math.max(0, c || 0))}%`;
};
// Value of c at a time, on the line between its neighbors.
const signalAt = (time) => {
  const times = scene.times, c = scene.c;
  let low = 0, high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle; else high = middle;
  }
  const width = times[high] - times[low];
  return width > 0 ? c[low] + ((c[high] - c[low]) * (time - times[low])) / width : c[low];
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
if (scene.times.length > 1) {
  find("player").hidden = false;
  slider.max = scene.times[scene.times.length - 1];
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
    tell(animator.time, signalAt(animator.time));
    if (!picture) requestAnimationFrame(follow);
  };
  follow();
}
if (scene.live) {
  find("player").hidden = false;
  find("play").hidden = slider.hidden = true;
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
  find("pane").replaceWith(image);
}
