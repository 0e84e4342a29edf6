// Keyboard, buttons, mouse, touch and gamepad. What keys do is decided in the module, by the table that the program's window has too.
import { tell } from "./screen.js";
import { hear } from "./simulator.js";

/** Keys that the browser must not use otherwise. */
const OURS = /^(Arrow|Key[A-Z]$|Digit|Space$|Tab$|Enter$|Backspace$|Equal$|Minus$|NumpadAdd$|NumpadSubtract$)/;
/** Turn of the 3D view by a drag, degrees a pixel, as in the program's window. */
const DEG_PER_PX = 0.4;

/** Whether somebody writes, or a dialog is open. */
const busy = () => document.querySelector("dialog[open]") || document.activeElement?.matches("select, input, textarea");

let modifiers = [false, false];
function modify(event) {
  const now = [event.shiftKey, event.ctrlKey];
  if (String(now) !== String(modifiers)) hear("modify", now);
  modifiers = now;
}

export function keyboard(help) {
  const pressed = new Set();
  addEventListener("keydown", (event) => {
    modify(event);
    if (event.code === "F1") {
      event.preventDefault();
      help();
    }
    // Shortcuts of the browser stay its own, but for Ctrl with arrows.
    const shortcut = event.metaKey || event.altKey || (event.ctrlKey && !event.code.startsWith("Arrow"));
    if (busy() || shortcut || !OURS.test(event.code)) return;
    // A button that has the focus is pressed by Enter or Space, and left by Tab.
    const onButton = document.activeElement?.matches("button:focus-visible");
    if (onButton && ["Enter", "Space", "Tab"].includes(event.code)) return;
    event.preventDefault();
    pressed.add(event.code);
    hear("key", [event.code, true, event.repeat]);
  });
  addEventListener("keyup", (event) => {
    modify(event);
    if (pressed.delete(event.code)) hear("key", [event.code, false, false]);
  });
  addEventListener("blur", () => {
    pressed.clear();
    hear("letGo");
  });
}

/** Whether a button would do nothing now; who presses it is told why. */
function idles(button) {
  if (button.classList.contains("idle")) tell(button.title, true);
  return button.classList.contains("idle");
}

export function buttons() {
  for (const button of document.querySelectorAll("[data-code]")) {
    button.addEventListener("click", () => {
      if (idles(button)) return;
      const { code } = button.dataset;
      const shift = "shift" in button.dataset;
      if (shift) hear("modify", [true, false]);
      hear("key", [code, true, false]);
      hear("key", [code, false, false]);
      if (shift) hear("modify", modifiers);
      button.blur();
    });
  }
  for (const button of document.querySelectorAll("[data-hold]")) {
    const hold = (down) => {
      if (button.classList.contains("down") === down || (down && idles(button))) return;
      button.classList.toggle("down", down);
      hear("key", [button.dataset.hold, down, false]);
    };
    button.addEventListener("pointerdown", (event) => {
      button.setPointerCapture(event.pointerId);
      hold(true);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) button.addEventListener(end, () => hold(false));
    button.addEventListener("keydown", ({ code }) => ["Space", "Enter"].includes(code) && hold(true));
    button.addEventListener("keyup", () => hold(false));
    button.addEventListener("contextmenu", (event) => event.preventDefault());
  }
}

/** How a gamepad is held, or the field as one: what was moved last counts. */
const lean = (now) => hear("gamepad", [Uint8Array.from(now.buttons), now.up, now.right, now.bend]);

/** The round field: a stick under the finger. */
export function field(hand, knob) {
  const move = (up, right) => {
    knob.style.transform = `translate(${right * 2.2}rem, ${-up * 2.2}rem)`;
    lean({ buttons: [], up, right, bend: 0 });
  };
  hand.addEventListener("pointerdown", (event) => {
    hand.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  hand.addEventListener("pointermove", (event) => {
    if (!hand.hasPointerCapture(event.pointerId)) return;
    const box = hand.getBoundingClientRect();
    const share = (at, from, size) => Math.max(-1, Math.min(1, (at - from - size / 2) / (size * 0.4)));
    move(-share(event.clientY, box.top, box.height), share(event.clientX, box.left, box.width));
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) hand.addEventListener(end, () => move(0, 0));
}

/** Asks for the first gamepad's state with each picture of the screen, and tells changes. */
export function gamepad() {
  let before = "";
  const look = () => {
    const pad = navigator.getGamepads().find((one) => one?.mapping === "standard");
    const now = pad
      ? { buttons: pad.buttons.flatMap((button, number) => (button.pressed ? [number] : [])), up: -pad.axes[1], right: pad.axes[2], bend: -pad.axes[3] }
      : { buttons: [], up: 0, right: 0, bend: 0 };
    const text = JSON.stringify(now);
    if (text !== before && (before || pad)) lean(now);
    before = text;
    if (pad) requestAnimationFrame(look);
  };
  addEventListener("gamepadconnected", look);
  addEventListener("gamepaddisconnected", look);
}

/** Drags, pinches and wheels on a picture: `drag` by pixels of the screen, `zoom` by a factor, `move` by pixels with Shift, the right button
 * or two fingers. */
function picture(canvas, drag, zoom, move = drag) {
  const fingers = new Map();
  const apart = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const wide = fingers.size === 2 ? apart() : 0;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const [x, y] = [event.clientX - before.x, event.clientY - before.y];
    if (fingers.size === 2) {
      if (wide > 0) zoom(apart() / wide);
      // Each finger has half of what both do.
      move(x / 2, y / 2);
    } else if (fingers.size === 1) {
      if (event.shiftKey || event.buttons === 2) move(x, y);
      else drag(x, y);
    }
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(1.1 ** Math.max(-5, Math.min(5, -event.deltaY / 40)));
  }, { passive: false });
}

/** The views; `fieldMm` tells how wide the live picture is at the isocentre. */
export function views(fluoro, second, three, fieldMm) {
  const table = (canvas, isSecond) => (x, y) => {
    const mmPerPx = fieldMm() / canvas.clientWidth;
    hear("input", { do: "table", right_mm: -x * mmPerPx, down_mm: -y * mmPerPx, second: isSecond });
  };
  const zoom = (what) => (factor) => hear("input", { do: what, factor: Math.max(0.1, Math.min(10, factor)) });
  picture(fluoro, table(fluoro, false), zoom("zoom"));
  picture(second, table(second, true), zoom("zoom"));
  const turn = (x, y) => hear("input", { do: "turn_camera", azimuth_deg: -x * DEG_PER_PX, elevation_deg: y * DEG_PER_PX });
  const move = (x, y) => hear("input", { do: "move_camera", right: -x / three.clientWidth, up: y / three.clientWidth });
  picture(three, turn, zoom("zoom_camera"), move);
}
