/* What the panel says of each control: one sentence with its formula, and a page of docs.
   SPDX-License-Identifier: MIT */
const r = 'r = 2 (n·v) n − v';
const FORMULAS = [
  [
    `L(r) = L<sub>in</sub>(r), ${r}: the sky itself, a resampling and no filter.`,
    'parameterizations'
  ],
  ['L(r) = ∫ max(r·l, 0)<sup>N</sup> L<sub>in</sub>(l) dl / norm: one lobe around r.', 'filters'],
  [
    'E(n)/π = Σ λ<sub>l</sub> a<sub>lm</sub> Y<sub>lm</sub>(n): nine ' +
        'numbers a channel, printed below.',
    'harmonics'
  ],
  ['L = F L(r) + (1 − F) albedo E(n)/π, with Fresnel’s F(n·v) for an index of 1.5.', 'materials'],
  [
    'L = L<sub>α</sub>(r) (f<sub>0</sub> scale + bias): GGX with n = v = r, and the split sum.',
    'materials.md#what-engines-use'
  ],
  [
    'k(x) = max(0, √(1−x²) √(1−c²) − xc − s) about the tangent t; 16 slices of c = v·t.',
    'filters.md#what-scenes-are-like-and-what-it-costs'
  ],
  [
    'L = factor(n·v) L(axis; n·v): a GGX copper as one table of angles, 16 slices of n·v.',
    'materials.md#fits-any-isotropic-brdf'
  ],
  [
    'L = Σ w<sub>i</sub> L(r<sub>i</sub>): lookups along an arc in a round Phong map.',
    'materials.md#anisotropy'
  ]
];
const METHODS = {
  0: ['rms ≤ tolerance: the cheapest way that keeps it.', 'accuracy-speed'],
  1: [
    'L(a) = Σ k(a·l) L<sub>in</sub>(l) ω(l) / Σ k ω over every texel: the definition.',
    'filters.md#reference'
  ],
  2: [
    '|k<sub>child</sub> − k<sub>parent</sub>| ≤ tolerance opens a texel: ' +
        'steps where a lobe changes its level.',
    'stability.md#a-threshold-on-lobes'
  ],
  3: [
    'filter = fill ∘ λ ∘ project: through harmonics, and sums of few texels where they cannot.',
    'filters.md#fast'
  ],
  4: [
    'L = Σ λ<sub>l</sub> a<sub>lm</sub> Y<sub>lm</sub>: harmonics alone, where bands suffice.',
    'harmonics'
  ],
  5: [
    'L<sub>i+1</sub> = mean of 2 × 2 texels of L<sub>i</sub>: squares, ' +
        'and seams along the edges of faces.',
    'stability.md#faces-mipmapped-alone'
  ],
  6: [
    'L ≈ Σ L<sub>in</sub>(l<sub>i</sub>)/16: the sun falls between ' +
        '16 directions and shows as spots.',
    'stability.md#fireflies'
  ],
  7: [
    'L = Σ λ<sub>l</sub> a<sub>lm</sub> Y<sub>lm</sub>, l ≤ 2: a sharp ' +
        'lobe rings, and light goes below zero.',
    'stability.md#ringing'
  ],
  8: [
    'L<sub>in</sub> → min(L<sub>in</sub>, 4 mean) in 8 bits: what is ' +
        'brighter is gone, the sun first of all.',
    'stability.md#maps-of-8-bits'
  ]
};
const WHY = {
  sky: [
    'L<sub>in</sub>(l) at u = ½ + atan2(x, −z)/2π, v = acos(y)/π; or drop an .hdr or .pfm. ' +
        'Drag in the map to move a sun.',
    'parameterizations.md#lat-long'
  ],
  file: [
    'L<sub>in</sub> = your picture, twice as wide as high: Radiance .hdr, or PFM.',
    'parameterizations.md#lat-long'
  ],
  flux: [
    'L<sub>in</sub> = sky + sun, so L = filter(sky) + ' +
        'filter(sun): all levels follow while ' +
        'it moves, and at rest are filtered anew.',
    'filters'
  ],
  azimuth: [
    'd = (cos h sin a, sin h, −cos h cos a): a = 0° is −z, the middle of the map.',
    'parameterizations.md#lat-long'
  ],
  height: [
    'd = (cos h sin a, sin h, −cos h cos a): h = 90° is +y, the map’s upper edge.',
    'parameterizations.md#lat-long'
  ],
  object: [
    `${r}: each point looks up with its own normal n and view v; no rays, no shadows.`,
    'stability.md#away-from-the-centre'
  ],
  look: () => FORMULAS[number('look')],
  roughness: [
    'α = roughness², at level 5 × ' +
        'roughness of the chain.',
    'materials.md#what-engines-use'
  ],
  metal: [
    'f<sub>0</sub> = 0.04 + metal (gold − 0.04), and (1 − metal) albedo E(n)/π besides.',
    'materials.md#what-engines-use'
  ],
  exponent: [
    'k(x) = max(x, 0)<sup>N</sup>, about 1/√N rad wide.',
    'stability.md#exponents-from-0-to-infinity'
  ],
  banks: [
    'k = 0 where √(1−x²) √(1−c²) − xc ≤ s: the larger s, the thinner the ring.',
    'stability.md#rings-thinner-than-a-texel'
  ],
  fit: ['α = roughness² of the copper that is fitted.', 'materials.md#fits-any-isotropic-brdf'],
  along: [
    's² = along² − across²: the variance of the lookups’ weights along the arc.',
    'materials.md#anisotropy'
  ],
  turn: ['L(R<sub>y</sub>(t) d): only the lookup turns, nothing is filtered.', 'shaders'],
  spin: ['n → R<sub>y</sub>(s) n: other lookups in the same maps.', 'shaders'],
  exposure: [
    'pixel = (1 − exp(−2<sup>EV</sup> ' +
        'L))<sup>1/2.2</sup>: maps stay linear.',
    'shaders'
  ],
  blur: [
    'level = 5 × blur of the GGX chain, behind the object; 0 is the sky itself.',
    'materials.md#what-engines-use'
  ],
  slowly: ['s = 12° × seconds; off where the system asks for less motion.', 'shaders'],
  method: () => METHODS[$('method').value],
  tolerance: [
    '√(Σ ω |a−b|² / Σ ω |b|²) ≤ tolerance: the rms error; the time pays for it.', 'accuracy-speed'
  ],
  'save-chain': [
    'level l = GGX of α = (l/5)²: six levels of half floats ' +
        'in KTX 2, as the tool bakes.',
    'bake'
  ],
  'save-sky': [
    'L<sub>in</sub> = sky + sun, lat-long: what an engine gets that filters for itself.', 'bake'
  ],
  'save-hdr': [
    '8 bits × 2<sup>e−136</sup>: the map that is ' +
        'looked up, as Radiance’s RGBE.',
    'bake'
  ],
  'save-pfm': [
    '32-bit floats of the map that is looked up, ' +
        'faces stacked: w × 6w.',
    'parameterizations'
  ],
  'save-sh': [
    'E(n)/π = Σ λ<sub>l</sub> a<sub>lm</sub> ' +
        'Y<sub>lm</sub>(n): seven vec4 and a function.',
    'harmonics.md#in-a-shader'
  ],
  copy: [
    'E(n)/π = Σ λ<sub>l</sub> a<sub>lm</sub> Y<sub>lm</sub>(n): ' +
        'the text below, into the clipboard.',
    'harmonics.md#in-a-shader'
  ]
};
