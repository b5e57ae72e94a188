// The lens of a picture in plain numbers. Offsets are { t, s } in view steps (down, right), disparities are in px per view
// step, as in the core. viewer/gpu/refocus has the same names in picture_lens.py and view_sampling.py and explains them.
//
// field: { rows, columns, width, height, range, hasDisparity, step, rowStep, layers, sample }; step: between views that
// are there, in view steps, the middle one among them; rowStep: distance between rows, in distances between columns;
// layers: theirs, by "t,s"; sample: some disparities. optics: { eye, focus, aperture, range, tilt, shape, highlights }, as
// in iibr_core/beyond/optics.py. Samples are { t, s, view, weight }: a camera's place from the eye, the view that answers
// it, and how much it counts.

import { NUMBERS, clamp, edgeDistance, slicesOf } from "./slices.js";

export const WHOLE = { x: 0, y: 0, width: 1, height: 1 };
export const hash = (place) => `${place.t},${place.s}`;
export const fraction = (number, step) => (number * step + 0.5) % 1;

const EDGE_MARGIN_PX = 4, MARGIN_STEP_PX = 4, TILT_STEPS = 17, CORNERS = [[0, 0], [1, 1], [1, 0], [0, 1]];
const sumOf = (weighted) => weighted.reduce((sum, one) => sum + one.weight, 0);

// Returns the first and the last offset of the stored views along an axis of `count` views.
export const ends = (count, step) => (
    [-(count >> 1), count - 1 - (count >> 1)].map((end) => Math.trunc(end / step) * step));

// Returns the views before and after a place along an axis with their shares, without shares of 0.
function bracket(x, count, step) {
    const [first, last] = ends(count, step), inside = clamp(x, first, last);
    const low = clamp(Math.floor(inside / step) * step, first, Math.max(last - step, first));
    const share = (inside - low) / step;
    return [[low, 1 - share], [low + step, share]].filter(([, weight]) => weight > 0);
}

// Returns the corners of a place's cell of the grid, with bilinear weights.
function cornersOf({ t, s }, { rows, columns, step }) {
    const across = bracket(s, columns, step);
    return bracket(t, rows, step).flatMap(([row, wt]) => across.map(([column, ws]) => (
        { t: row, s: column, weight: wt * ws })));
}

// Returns the stored views that an aperture adds up: views without disparity cannot be warped. See aperture_sampling.py.
export function viewsInAperture({ shape, diameter, eye }, field) {
    const side = NUMBERS.APERTURE_SIDE, cut = Math.min(Math.max(field.rows, field.columns) / diameter, 1);
    const cell = Math.min(Math.SQRT2 * cut, 1) / side, distance = edgeDistance(shape), asked = new Map();
    const places = Array.from({ length: side }, (_, i) => cell * (i + 0.5 - side / 2));
    for (const [t, s] of places.flatMap((t) => places.map((s) => [t, s]))) {
        const inside = Math.min(distance(t, s), cut / 2 - Math.max(Math.abs(t), Math.abs(s)));
        const open = clamp(0.5 + inside / cell, 0, 1);
        for (const corner of open ? cornersOf({ t: eye.t + diameter * t, s: eye.s + diameter * s }, field) : []) {
            const weight = open * corner.weight + (asked.get(hash(corner))?.weight ?? 0);
            asked.set(hash(corner), { ...corner, weight });
        }
    }
    const all = sumOf([...asked.values()]);
    const kept = [...asked.values()].filter(({ weight }) => weight > NUMBERS.MIN_WEIGHT * all), total = sumOf(kept);
    return kept.map((view) => ({ t: view.t - eye.t, s: view.s - eye.s, view, weight: view.weight / total }));
}

// ---- The lens

// Returns the lens of a picture of this width: the optics with their slices, which a pinhole and views without disparity
// have not; discPx: diameter of a disc for a disparity of 1 px per view step; marginPx: width of the border from which
// light comes.
export function lensOf(optics, field, widthPx, level = NUMBERS.LEVELS[0]) {
    const diameter = Math.max(optics.aperture, 0), beside = besidesOf(optics, field);
    const widest = beside.reduce((most, each) => Math.max(most, Math.abs(each)), 1e-9);
    const texelPx = widthPx / field.width, discPx = Math.min(diameter * texelPx, widthPx / widest);
    const slices = discPx > 0 && field.hasDisparity ? slicesOf(beside.map((each) => discPx * each), optics.shape) : [];
    const reachPx = Math.max(...slices.map((slice) => slice.reachPx)) + EDGE_MARGIN_PX;
    const marginPx = slices.length && MARGIN_STEP_PX * Math.ceil(reachPx / MARGIN_STEP_PX);
    const gain = NUMBERS.HIGHLIGHT_GAIN * optics.highlights * Math.min(diameter, 1);
    return { ...optics, diameter, slices, discPx, texelPx, marginPx, gain, level };
}

// Returns how far disparities that occur in a picture lie beside those in focus.
function besidesOf({ focus, range, tilt }, { sample }) {
    const most = Math.abs(tilt[0]) + Math.abs(tilt[1]), steps = most ? TILT_STEPS : 1;
    const tilts = Array.from({ length: steps }, (_, i) => (most ? most * (2 * i / (steps - 1) - 1) : 0));
    const besides = tilts.flatMap((more) => sample.map((each) => each - focus - more));
    return besides.map((each) => Math.sign(each) * Math.max(Math.abs(each) - range, 0));
}

// Returns the number of passes until the edges of a pinhole's picture are smooth.
export function passCount(lens, field) {
    const isStored = !lens.dolly && field.layers.has(hash(lens.eye));
    return field.hasDisparity && !isStored && lens.level === NUMBERS.LEVELS[0] ? NUMBERS.EDGE_PASSES : 1;
}

// Returns the cameras of a pass and the views that answer them, or the camera of a picture's disparity. With dolly, an
// answer is told how the shader finds its view, see lens.frag.
export function samplesOf(lens, field, isDisparity = false) {
    if (lens.diameter > 0 && !field.hasDisparity) {
        const samples = viewsInAperture(lens, field), [down, across] = NUMBERS.SQRT_STEPS;
        const answer = (i) => [fraction(i, across), fraction(i, down), 0];
        return lens.dolly ? samples.map((one, i) => ({ ...one, answer: answer(i) })) : samples;
    }
    if (lens.dolly) {
        const answers = isDisparity ? [[0.5, 0.5, 0]] : CORNERS.map((corner) => [...corner, 1]);
        return answers.map((answer) => ({ t: 0, s: 0, view: { t: 0, s: 0 }, weight: 1, answer }));
    }
    const heaviest = cornersOf(lens.eye, field).sort((a, b) => b.weight - a.weight);
    const sources = heaviest.slice(0, isDisparity ? 1 : lens.level.sources), total = sumOf(sources);
    return sources.map((view) => ({ t: 0, s: 0, view, weight: view.weight / total }));
}

// Returns the disparity at a place of the picture (0..1) as the eye sees it: of the first surface in the middle view.
export function pick(field, middle, eye, u, v) {
    const [far, near] = field.range, { width, height } = field;
    const across = eye.s, down = field.rowStep * eye.t;
    const steps = 2 * Math.ceil(Math.max(Math.abs(across), Math.abs(down)) * (near - far)) + 1;
    for (let k = 0; ; k++) {
        const disparity = near - (near - far) * k / steps;
        const x = clamp(Math.floor(u * width + disparity * across), 0, width - 1);
        const y = clamp(Math.floor(v * height + disparity * down), 0, height - 1);
        const seen = far + (near - far) * middle[y * width + x] / 255;
        if (seen >= disparity || k >= steps) return seen;
    }
}
