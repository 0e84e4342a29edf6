// A wire pushed into the left carotid artery, in Node.js or a bundler: node example.mjs ASSETS, the folder `assets` of the page.
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import init, { Session, missingFiles } from "./endowire.js";

await init({ module_or_path: await readFile(new URL("endowire_bg.wasm", import.meta.url)) });

const assets = process.argv[2] ?? "../assets";
const path = "scenes/arch_carotid.toml";
const files = new Map();
for (let missing; (missing = missingFiles(files, path)).length; ) {
  for (const name of missing) files.set(name, new Uint8Array(await readFile(join(assets, name))));
}

const session = new Session(files, path, 256);
session.apply({ do: "pedal", down: true });
session.apply({ do: "script" });
do session.tick(); while (session.readout().demonstrates);

const { step, instruments, wall_force_n: force } = session.readout();
console.log(`${step} steps, ${instruments[0].inserted_mm.toFixed(1)} mm in, at most ${force.toFixed(3)} N on the wall`);
console.log(`tip at ${session.positions().slice(-3).map((mm) => mm.toFixed(2)).join(", ")} mm`);

const [{ width, height, data }] = session.fluoro();
const grey = data.filter((_, index) => index % 4 === 0);
await writeFile("carotid.pgm", Buffer.concat([Buffer.from(`P5 ${width} ${height} 255\n`), Buffer.from(grey)]));
await writeFile("played.toml", session.script());
