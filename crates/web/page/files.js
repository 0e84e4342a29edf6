// Files of scenes: those of the page, and those that were dropped on it.
import { ask } from "./simulator.js";

/** Files that were dropped or written, by their paths; they come before those of the page. */
export const own = new Map();

const encoder = new TextEncoder();

async function fetched(path) {
  const response = await fetch(new URL(path, new URL("assets/", location.href)));
  if (!response.ok) throw new Error(`${path}: this file is not there (${response.status})`);
  return new Uint8Array(await response.arrayBuffer());
}

/** The bytes of a file. */
export const read = async (path) => own.get(path) ?? fetched(path);

/** The text of a file. */
export const readText = async (path) => new TextDecoder().decode(await read(path));

/** All files that a scene or a subject needs, with the script that takes the place of its own. */
export async function filesOf(path, script) {
  const files = new Map([[path, await read(path)]]);
  const asked = new Set();
  for (;;) {
    const missing = (await ask("missing", { files, path })).filter((name) => !asked.has(name));
    if (missing.length === 0) break;
    await Promise.all(missing.map(async (name) => {
      asked.add(name);
      // What is not there is told by the scene, with the key that names it.
      const found = await read(name).catch(() => null);
      if (found) files.set(name, found);
    }));
  }
  if (script) files.set("script.toml", encoder.encode(script));
  return files;
}

/** Keeps a text as a file. */
export const write = (path, text) => own.set(path, encoder.encode(text));

/** Gives a file to whoever looks at the page. */
export function save(name, content, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

async function through(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}

/** A value as the fragment of a link: nothing of it goes to a server. */
export async function toFragment(value) {
  const bytes = await through(encoder.encode(JSON.stringify(value)), new CompressionStream("deflate-raw"));
  const text = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  return text.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** The value of a fragment. */
export async function ofFragment(text) {
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (letter) => letter.charCodeAt(0));
  return JSON.parse(new TextDecoder().decode(await through(bytes, new DecompressionStream("deflate-raw"))));
}
