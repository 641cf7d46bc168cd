"use strict";
// The self-motion of an arm and its control signal, from the numbers in the page alone.
// Positions are (x, y, z) in m in the thorax frame; rotations are rows of 3 x 3.
(() => {
  const find = (id) => document.getElementById(`elbow-${id}`);
  const data = JSON.parse(find("data").textContent);
  // Steps along the self-motion, rad; how far c may leave 0 to 1; where Newton stops, m or rad.
  const STEP = 0.02, BEYOND = 0.15, HELD = 1e-11, MOST = 400;

  const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
  const add = (a, b, s = 1) => a.map((x, k) => x + s * b[k]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const times = (A, b) => A.map((row) => dot(row, b));
  const turn = (R) => R[0].map((_, k) => R.map((row) => row[k]));
  const product = (A, B) => A.map((row) => turn(B).map((column) => dot(row, column)));
  const unit = (a) => a.map((x) => x / Math.sqrt(dot(a, a)));
  // Rodrigues' formula.
  const rotation = ([x, y, z], angle) => {
    const s = Math.sin(angle), v = 1 - Math.cos(angle);
    return [
      [1 - v * (y * y + z * z), v * x * y - s * z, v * x * z + s * y],
      [v * x * y + s * z, 1 - v * (x * x + z * z), v * y * z - s * x],
      [v * x * z - s * y, v * y * z + s * x, 1 - v * (x * x + y * y)],
    ];
  };

  // Where the links are at a posture, and the axes of the joints.
  function arm(q) {
    let p = [0, 0, 0], R = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const links = {}, joints = [];
    for (const link of data.links) {
      p = add(p, times(R, link.at));
      R = product(R, link.turn);
      if (link.joint !== null) {
        const axis = unit(link.axis);
        joints[link.joint] = { at: p, axis: times(R, axis) };
        R = product(R, rotation(axis, q[link.joint]));
      }
      links[link.link.replace(/^(right|left)_/, "")] = { p, R };
    }
    const hand = { p: add(p, times(R, data.hand)), R };
    return { links, joints, hand };
  }

  // Rows of the hand's Jacobian: position, then orientation.
  function jacobian({ joints, hand }) {
    return turn(joints.map(({ at, axis }) => [...cross(axis, add(hand.p, at, -1)), ...axis]));
  }

  // Solution x of A x = b by elimination with pivots.
  function solve(A, b) {
    const rows = A.map((row, k) => [...row, b[k]]), n = rows.length;
    for (let k = 0; k < n; k += 1) {
      let best = k;
      for (let i = k; i < n; i += 1) if (Math.abs(rows[i][k]) > Math.abs(rows[best][k])) best = i;
      [rows[k], rows[best]] = [rows[best], rows[k]];
      for (let i = 0; i < n; i += 1) if (i !== k) rows[i] = add(rows[i], rows[k], -rows[i][k] / rows[k][k]);
    }
    return rows.map((row, k) => row[n] / row[k]);
  }

  // The shortest change of posture with which the hand changes by b.
  const shortest = (J, b) => times(turn(J), solve(product(J, turn(J)), b));

  function error(hand, target) {
    const E = product(target.R, turn(hand.R));
    return [...add(target.p, hand.p, -1), (E[2][1] - E[1][2]) / 2, (E[0][2] - E[2][0]) / 2, (E[1][0] - E[0][1]) / 2];
  }

  // The posture near q with the hand at its target; null where Newton's method fails.
  function held(q, target) {
    for (let k = 0; k < 12; k += 1) {
      const now = arm(q), e = error(now.hand, target);
      if (Math.max(...e.map(Math.abs)) < HELD) return q;
      q = add(q, shortest(jacobian(now), e));
      if (!q.every(Number.isFinite)) return null;
    }
    return null;
  }

  const signal = (q, point) => (dot(point.z, q) - point.lower) / (point.upper - point.lower);

  // Postures on one side, up to a joint limit or to where c leaves its range.
  function side(point, target, way) {
    const found = [];
    let q = point.q, heading = point.z.map((x) => way * x);
    while (found.length < MOST) {
      const J = jacobian(arm(q));
      heading = add(heading, shortest(J, times(J, heading)), -1);
      if (dot(heading, heading) < 1e-12) break;
      heading = unit(heading);
      const next = held(add(q, heading, STEP), target);
      if (next === null || next.some((x, k) => x < data.limits[0][k] || x > data.limits[1][k])) break;
      const c = signal(next, point);
      if (c < -BEYOND || c > 1 + BEYOND) break;
      found.push(next);
      q = next;
    }
    return found;
  }

  let point, target, way, place;
  const choose = (k) => {
    point = data.points[k];
    target = arm(point.q).hand;
    const before = side(point, target, -1).reverse();
    way = [...before, point.q, ...side(point, target, 1)];
    drawWay();
    fit();
    set(before.length);
  };
  // Go to a place along the way; between two of its postures too.
  const set = (where) => {
    place = Math.min(way.length - 1, Math.max(0, where));
    const k = Math.min(way.length - 2, Math.floor(place)), share = place - k;
    const q = way.length < 2 ? way[0] : held(add(way[k].map((x) => (1 - share) * x), way[k + 1], share), target);
    show(q ?? way[Math.round(place)]);
  };

  // From the camera: right and down on the paper, in its own units.
  const look = unit(add(data.target, data.camera, -1)), right = unit(cross(look, [0, 1, 0])), up = cross(right, look);
  const SCALE = 640;
  const paper = (p) => {
    const d = add(p, data.target, -1);
    return [240 + SCALE * dot(d, right), 228 - SCALE * dot(d, up)];
  };
  const path = (points) => `M${points.map((p) => paper(p).map((x) => x.toFixed(2)).join(" ")).join("L")}`;
  const draw = (id, d) => find(id).setAttribute("d", d);
  const within = ({ p, R }, at) => add(p, times(R, at));

  let elbows;
  function drawWay() {
    elbows = way.map((q) => arm(q).links.forearm.p);
    draw("way", path(elbows));
    const links = arm(point.q).links, shoulder = links.upper_arm.p, other = [shoulder[0], shoulder[1], -shoulder[2]];
    const [x, y] = paper([-0.03, 0.22, 0]);
    find("trunk").innerHTML = `<circle cx="${x}" cy="${y}" r="${0.1 * SCALE}"/><path d="${path([[-0.055, 0.12, 0], [-0.06, -0.05, 0]])}" stroke-width="${0.1 * SCALE}"/><path d="${path([shoulder, other])}" stroke-width="${0.07 * SCALE}"/><path d="${path([[-0.06, -0.06, 0], [-0.06, -0.24, 0]])}" stroke-width="${0.24 * SCALE}"/>`;
  }

  // Show the whole body, and the arm wherever the elbow goes; hand and finger reach this far from the wrist, m.
  const BEYOND_WRIST = 0.24;
  function fit() {
    const seen = [[-0.03, 0.32, 0], [-0.06, -0.36, 0]].map((p) => [...paper(p), 0.12 * SCALE]);
    for (const q of way) {
      const { links } = arm(q);
      const shoulder = links.upper_arm.p;
      seen.push([...paper([shoulder[0], shoulder[1], -shoulder[2]]), 30], [...paper(shoulder), 30], [...paper(links.forearm.p), 30]);
      seen.push([...paper(links.hand.p), BEYOND_WRIST * SCALE]);
    }
    const least = [0, 1].map((k) => Math.min(...seen.map((at) => at[k] - at[2])));
    const most = [0, 1].map((k) => Math.max(...seen.map((at) => at[k] + at[2])));
    const height = Math.max(most[1] - least[1], (most[0] - least[0]) / 1.2), width = 1.2 * height;
    const from = [0, 1].map((k) => (least[k] + most[k] - [width, height][k]) / 2);
    find("arm").setAttribute("viewBox", [...from, width, height].map((x) => x.toFixed(1)).join(" "));
  }

  // Fingers of the hand as in the URDF: x to the thumb, y along; m.
  const FINGERS = [[0.029, -0.147], [0.0097, -0.156], [-0.0097, -0.149], [-0.0285, -0.131]];
  function drawHand(hand) {
    const fingers = FINGERS.map(([x, tip]) => path([within(hand, [x, -0.01, 0]), within(hand, [x, tip, 0])]));
    const thumb = path([within(hand, [0.025, -0.015, 0]), within(hand, [0.062, -0.09, -0.008 * data.side])]);
    draw("hand", [...fingers, thumb].join(""));
  }

  function drawFinger(fore, flexion) {
    const { worn, joints, axes, full } = data.finger;
    const W = worn.slice(0, 3).map((row) => row.slice(0, 3));
    let p = within(fore, worn.slice(0, 3).map((row) => row[3])), R = product(fore.R, W);
    const wrist = within(fore, [0, worn[1][3], 0]), points = [wrist, p];
    joints.forEach((at, k) => {
      p = add(p, times(R, at));
      R = product(R, rotation(axes[k], full * flexion));
      points.push(p);
    });
    // The tip is one module beyond the last joint.
    draw("finger", path([...points, add(p, times(R, joints[joints.length - 1]))]));
  }

  const state = { count: 0 };
  function show(q) {
    const { links, hand } = arm(q), c = signal(q, point);
    // A point where nothing moved has no range, and no c.
    const flexion = Number.isFinite(c) ? Math.min(1, Math.max(0, c)) : 0;
    Object.assign(state, { q, c, flexion, hand: hand.p, places: way.length, point: data.points.indexOf(point), count: state.count + 1 });
    draw("upper", path([links.upper_arm.p, links.forearm.p]));
    draw("fore", path([links.forearm.p, links.hand.p]));
    drawHand(links.hand);
    drawFinger(links.forearm, flexion);
    const [x, y] = paper(links.forearm.p);
    find("grip").setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
    find("place").value = way.length > 1 ? place / (way.length - 1) : 0;
    find("c").textContent = Number.isFinite(c) ? c.toFixed(2) : "unknown";
    find("flexion").textContent = `${Math.round(100 * flexion)} % bent`;
    const moved = Math.sqrt(dot(add(hand.p, target.p, -1), add(hand.p, target.p, -1)));
    find("moved").textContent = `${(1000 * moved).toFixed(1)} mm`;
    find("gauge").style.width = `${100 * flexion}%`;
  }

  // The place on the way that is nearest to a point on the paper.
  function nearest([x, y]) {
    let best = 0, least = Infinity;
    const at = elbows.map(paper);
    for (let k = 0; k + 1 < at.length; k += 1) {
      const [ax, ay] = at[k], bx = at[k + 1][0] - ax, by = at[k + 1][1] - ay;
      const s = Math.min(1, Math.max(0, ((x - ax) * bx + (y - ay) * by) / (bx * bx + by * by || 1)));
      const off = Math.hypot(ax + s * bx - x, ay + s * by - y);
      if (off < least) [least, best] = [off, k + s];
    }
    return best;
  }

  const picture = find("arm"), grip = find("grip");
  const drag = (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(picture.getScreenCTM().inverse());
    set(nearest([at.x, at.y]));
  };
  grip.addEventListener("pointerdown", (event) => { grip.setPointerCapture(event.pointerId); drag(event); });
  grip.addEventListener("pointermove", (event) => { if (event.buttons) drag(event); });
  find("place").addEventListener("input", (event) => set(Number(event.target.value) * (way.length - 1)));
  data.points.forEach((_, k) => find("point").add(new Option(String(k + 1), String(k))));
  find("point").value = String(data.first);
  find("point").addEventListener("change", (event) => choose(Number(event.target.value)));
  choose(data.first);
  window.elbow = { state, set, choose };
})();
