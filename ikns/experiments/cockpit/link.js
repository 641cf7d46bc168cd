// The web socket: newest frames come in, what is pressed goes out.

export const find = (id) => document.getElementById(id);

// Calls take[kind](message) for each message; returns what sends one.
export function connect(role, take) {
  let socket = null;
  const open = () => {
    socket = new WebSocket(`ws://${location.host}/link?role=${role}`);
    socket.onopen = () => { find("lost").hidden = true; };
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      take[message.kind]?.(message);
    };
    socket.onclose = () => {
      find("lost").hidden = false;
      take.closed?.();
      setTimeout(open, 1000);
    };
  };
  open();
  return (message) => {
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  };
}

// Text only where it changed: a page that is not touched costs nothing.
export function write(id, text) {
  const element = find(id);
  if (element.textContent !== text) element.textContent = text;
}

export const known = (value) => value !== null && value !== undefined;
