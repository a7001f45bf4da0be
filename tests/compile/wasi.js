// SPDX-License-Identifier: MIT
// usage: node tests/compile/wasi.js PROGRAM: runs a wasm32-wasi program in the present folder.
const { readFileSync } = require("fs");
const { WASI } = require("wasi");

const wasi = new WASI({
  version: "preview1",
  args: process.argv.slice(2),
  env: process.env,
  preopens: { ".": "." },
  returnOnExit: true,
});
WebAssembly.instantiate(readFileSync(process.argv[2]), wasi.getImportObject()).then(
  ({ instance }) => (process.exitCode = wasi.start(instance)),
);
