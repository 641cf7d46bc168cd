// The web socket: newest states come in, commands and signals go out.

export const find = (id) => document.getElementById(id);

// Without a state that is newer than this, nothing on the page is certain, ms.
const KNOWN_FOR = 1000;

// Calls handlers[kind](message) for each message; returns a function that sends one.
export function connect(role, handlers) {
  let socket = null, told = performance.now();
  const watch = () => {
    const age = performance.now() - told, open = socket.readyState === WebSocket.OPEN;
    find("lost").hidden = open && age <= KNOWN_FOR;
    if (!find("lost").hidden) write("lost", open ? `No update from the program for ${(age / 1000).toFixed(0)} s` : "Connection lost. If the command was restarted, open the address that it printed.");
  };
  const open = () => {
    socket = new WebSocket(`ws://${location.host}/link?role=${role}`);
    socket.onopen = () => { told = performance.now(); };
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      if (message.kind === "now") told = performance.now() - 1000 * message.now_age;
      handlers[message.kind]?.(message);
    };
    socket.onclose = () => setTimeout(open, 1000);
  };
  open();
  setInterval(watch, 250);
  return (message) => {
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  };
}

// Write text only where it changed: unchanged elements are not drawn again.
export function write(id, text) {
  const element = find(id);
  if (element.textContent !== text) element.textContent = text;
}

export const known = (value) => value !== null && value !== undefined;
