// What the pages tell people to do, and what a training trial was worth.
import { known } from "/link.js";

export const STATES = {
  waiting: "Waiting", align: "Align", track: "Tracking", ready: "Ready", running: "Running", judge: "How did it go?",
  rest: "Rest", paused: "Paused", finished: "Finished", stopped: "STOPPED",
};

// What the participant does with a condition, in a few words.
const HINTS = {
  keyboard: "Up and down with the arrow keys, or W and S",
  mouse: "The pointer follows the mouse",
  gamepad: "Push the stick up",
  ikns: "Lift and lower the elbow; the hand stays",
  ring: "Press the button to close, again to open",
  virtual: "A virtual operator is in control",
};
// The same for the first trial, as sentences: tracking, then picking where it differs.
const MOVES = {
  keyboard: "Hold the up arrow (or W) to move the red dot up, the down arrow (or S) to move it down.",
  mouse: "Move the mouse up and down; the red dot follows it.",
  gamepad: "Push the left stick up to move the red dot up. Let it go to bring the dot down.",
  trigger: "Press the right trigger to move the red dot up. Let it go to bring the dot down.",
  ikns: "Lift your elbow to move the red dot up, lower it to move the dot down. Keep your hand where it is.",
  virtual: "A virtual operator moves the red dot; just watch.",
};
const GRASPS = {
  ikns: "Lift your elbow to close the finger, lower it to open the finger. Keep your hand where it is.",
  ring: "Press the button to close the finger. Press it again to open the finger.",
};
const KEYS = { keyboard: "the space bar", mouse: "the space bar", gamepad: "the first button or the space bar" };

const trigger = (shown, hello) => shown.condition === "gamepad" && hello.stick === "trigger";

export function hint(shown, hello) {
  if (hello.role !== "participant") return "Another page is in control; this one only watches";
  const words = trigger(shown, hello) ? "Press the right trigger" : HINTS[shown.condition] ?? "";
  const key = KEYS[shown.condition];
  return shown.state === "waiting" && shown.page_condition && key ? `${words}. Begin with ${key}.` : words;
}

// The attempt before this one: its condition, kind and numbers; null for none.
function last(shown) {
  const attempt = shown.attempts[shown.attempts.length - 1];
  if (!attempt) return null;
  const [condition, kind] = attempt.key.split("/");
  return { ...attempt, condition, kind };
}

// Sentences before the first trial with a condition; none later.
export function instructions(shown, hello) {
  if (shown.state !== "waiting" || shown.step === null || last(shown)?.condition === shown.condition) return [];
  const begin = KEYS[shown.condition] && shown.page_condition ? `Press ${KEYS[shown.condition]} when you are ready.` : "The experimenter starts each trial.";
  const training = shown.step.kind === "training";
  if (shown.experiment === "picking")
    return [
      GRASPS[shown.condition] ?? "",
      "When the clock starts, pick the object up and put it down where you were shown.",
      "Be quick, but do not drop it.",
      training ? "The first trials are for training. After each you see your time." : "",
      begin,
    ].filter(Boolean);
  return [
    MOVES[trigger(shown, hello) ? "trigger" : shown.condition] ?? "",
    "First bring the red dot to where the black line starts.",
    "Then the dot moves to the right by itself. Keep it on the line.",
    training ? "The first trials are for training. After each you see your score." : "",
    begin,
  ].filter(Boolean);
}

// After a training trial: what it was worth, as [large, small]; null otherwise.
export function score(shown) {
  const attempt = ["waiting", "rest", "paused"].includes(shown.state) ? last(shown) : null;
  if (attempt === null || attempt.kind !== "training") return null;
  if (shown.experiment === "picking") {
    const said = { success: "from start to finish", dropped: "The object was dropped.", timeout: "Time ran out." }[attempt.outcome];
    if (!said) return null;
    return attempt.outcome === "success" && known(attempt.time) ? [`${attempt.time.toFixed(1)} s`, said] : ["", said];
  }
  if (attempt.outcome !== "done" || !known(attempt.rmse)) return null;
  const before = shown.attempts.slice(0, -1).reverse().find((a) => known(a.rmse) && a.key.startsWith(`${attempt.condition}/training/`));
  const then = before ? ` The time before: ${before.rmse.toFixed(1)}.` : "";
  return [attempt.rmse.toFixed(1), `was your distance from the line (0 is perfect, the screen is 100 high).${then}`];
}

// What the experimenter does next.
export function next(shown) {
  const { state } = shown;
  if (shown.stopped !== null) return shown.stopped.remedy;
  if (state === "waiting") {
    if (shown.page_condition && !shown.page_connected) return "Open the participant's page, on their screen.";
    if (!known(shown.c)) return shown.page_condition ? "There is no control signal yet: move the participant's device." : "There is no control signal yet: check cameras and markers.";
    return shown.experiment === "picking" ? "Put the object in place, then press Begin." : "Press Begin when the participant is ready.";
  }
  return {
    align: "The participant brings the dot to the start of the line.",
    track: "The participant follows the line. Abort if something went wrong; the trial comes again.",
    ready: "Start the clock when the participant starts (space bar).",
    running: "Press Success or Dropped when it ends; the space bar stops the clock first.",
    judge: "The clock has stopped: press Success or Dropped.",
    rest: "Let the participant rest. Skip ends the rest early.",
    paused: "Press Continue to go on.",
    finished: "All trials are done: end the run.",
  }[state] ?? "";
}
