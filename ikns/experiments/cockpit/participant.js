import { connect, find, known, write } from "/link.js";
import { Hands } from "/hands.js";
import { Plot } from "/plot.js";
import { hint, instructions, score } from "/words.js";

let hello = { role: "viewer", stick: "left", experiment: "tracking" }, shown = null;
const plot = new Plot(find("plot"), { big: true });
// Input is read 60 times per second, even where the screen draws more slowly.
const EVERY = 1000 / 60;
const send = connect("participant", {
  hello(message) {
    hello = message;
    hands.stick = message.stick;
    find("simulated").hidden = !message.simulated;
    find("viewer").hidden = message.role === "participant";
    document.title = message.simulated ? "Participant (simulated)" : "Participant";
  },
  curve(message) { plot.begin(message); },
  now(message) { shown = message; },
});
const inControl = () => hello.role === "participant" && shown !== null;
const hands = new Hands(plot, {
  onBegin: () => inControl() && send({ command: hello.experiment === "picking" ? "toggle" : "begin" }),
  onPress: () => {
    if (!inControl()) return;
    if (shown.condition === "ring") send({ command: "press" });
    else if (hello.experiment === "tracking") send({ command: "begin" });
  },
  onStop: () => send({ command: "emergency" }),
});

const seconds = (value) => (value >= 60 ? `${Math.floor(value / 60)}:${String(Math.ceil(value) % 60).padStart(2, "0")}` : String(Math.ceil(value)));

// Instructions before the first trial, and the score of a training trial.
function showCard() {
  const todo = instructions(shown, hello), worth = score(shown);
  find("card").hidden = !todo.length && worth === null;
  find("score").hidden = worth === null;
  write("points", worth?.[0] ?? "");
  write("meaning", worth?.[1] ?? "");
  find("how").hidden = find("steps").hidden = !todo.length;
  const list = find("steps"), text = todo.join("\n");
  if (list.dataset.text === text) return;
  list.dataset.text = text;
  list.replaceChildren(...todo.map((sentence) => {
    const item = document.createElement("li");
    item.textContent = sentence;
    return item;
  }));
}

function showTrial() {
  const { state, trial, step } = shown, picking = shown.experiment === "picking";
  find("plot").hidden = picking;
  find("thing").hidden = !picking;
  const counts = state === "align" || state === "rest";
  write("count", counts && !picking && shown.countdown > 0 ? seconds(shown.countdown) : "");
  if (!picking) return plot.draw({ state, trial, c: shown.c });
  const rest = state === "rest", there = step !== null && step.kind !== "rest";
  write("code", there ? `Object ${step.what}` : "");
  write("name", there ? step.name : "");
  const running = known(trial.time_left);
  write("left", rest ? seconds(shown.countdown) : running ? seconds(trial.time_left) : "");
  find("bar").hidden = !running;
  if (running) find("bar").firstElementChild.style.width = `${(100 * trial.time_left) / trial.limit}%`;
}

function steer() {
  if (shown === null) return;
  const c = hands.c(shown.condition);
  const device = shown.condition === "gamepad" ? hands.gamepad : "";
  if (hello.role === "participant" && shown.page_condition) send({ condition: shown.condition, c, n: shown.n, device });
  else send({ n: shown.n });
}

function frame() {
  if (shown !== null) {
    document.body.classList.toggle("stopped", shown.state === "stopped");
    write("prompt", shown.prompt);
    const done = shown.trials - shown.trials_left, training = shown.step?.kind === "training";
    write("place", shown.trials_left ? `${training ? "Training, " : ""}${done + 1} of ${shown.trials}` : "");
    write("hint", hint(shown, hello));
    showCard();
    write("input", shown.page_condition && hello.role === "participant" ? input() : "");
    showTrial();
  }
  requestAnimationFrame(frame);
}

// Which device is read, or what to do for a signal.
function input() {
  if (shown.condition === "gamepad") return hands.gamepad;
  if (shown.condition === "mouse" && !known(shown.c)) return "Move the mouse over this page";
  return "";
}

setInterval(steer, EVERY);
requestAnimationFrame(frame);
