// The web socket: newest states come in, commands and signals go out.

export const find = (id) => document.getElementById(id);

// Calls handlers[kind](message) for each message; returns a function that sends one.
export function connect(role, handlers) {
  let socket = null;
  const open = () => {
    socket = new WebSocket(`ws://${location.host}/link?role=${role}`);
    socket.onopen = () => { find("lost").hidden = true; };
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      handlers[message.kind]?.(message);
    };
    socket.onclose = () => {
      find("lost").hidden = false;
      setTimeout(open, 1000);
    };
  };
  open();
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
