// SPDX-License-Identifier: MIT
// usage: node tests/read_ktx2.mjs [FILE FORMAT EDGE LEVELS FACES]
// Reads a KTX 2 file with npm's ktx-parse, and holds its header against what was written. Exit
// status 0: it is so; without arguments: ktx-parse is here. It is looked for in the folder NODE_MODULES,
// else in build/npm, and then where node always looks.
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { resolve } from 'node:path';
import { strict as assert } from 'node:assert';

const require = createRequire(resolve(process.env.NODE_MODULES || 'build/npm') + '/');
const { read } = require('ktx-parse');
const [file, format, edge, levels, faces] = process.argv.slice(2);
if (file) {
    const formats = {
        RGBA16F: [97, 8, 4, 2], RGBA32F: [109, 16, 4, 4], RGB9E5: [123, 4, 6, 4],
        B10G11R11: [122, 4, 3, 4] };
    const [vk, bytes, samples, typeSize] = formats[format];
    const k = read(new Uint8Array(readFileSync(file)));
    assert.equal(k.vkFormat, vk);
    assert.equal(k.typeSize, typeSize);
    assert.equal(k.pixelWidth, +edge);
    assert.equal(k.pixelHeight, +edge);
    assert.equal(k.faceCount, +faces);
    assert.equal(k.levels.length, +levels);
    assert.equal(k.supercompressionScheme, 0);
    k.levels.forEach((level, l) =>
        assert.equal(level.levelData.byteLength, faces * bytes * Math.max(1, edge >> l) ** 2));
    const d = k.dataFormatDescriptor[0];
    assert.equal(d.colorModel, 1);
    assert.equal(d.colorPrimaries, 1);
    assert.equal(d.transferFunction, 1);
    assert.equal(d.bytesPlane[0], bytes);
    assert.equal(d.samples.length, samples);
    assert.equal(k.keyValue.KTXorientation, 'rd');
}
