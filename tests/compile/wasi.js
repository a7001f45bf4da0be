// SPDX-License-Identifier: MIT
// usage: node tests/compile/wasi.js PROGRAM: runs a wasm32-wasi program, which sees the present
// folder and its own.
const { readFileSync } = require("fs");
const { dirname } = require("path");
const { WASI } = require("wasi");

const own = dirname(process.argv[2]);
const wasi = new WASI({
  version: "preview1",
  args: process.argv.slice(2),
  env: process.env,
  preopens: { ".": ".", [own]: own },
  returnOnExit: true,
});
WebAssembly.instantiate(readFileSync(process.argv[2]), wasi.getImportObject()).then(
  ({ instance }) => (process.exitCode = wasi.start(instance)),
);
