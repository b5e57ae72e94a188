// Slices of defocus and the disc of each: iibr_core/beyond/lens_slices.py and aperture_shape.py have the same names and
// explain them. A slice: { diameterPx, level, taps, reachPx }; taps: [x, y, weight].

// Numbers of the core by name, which the page carries: see iibr_core/exports/web.py.
export const NUMBERS = {};
export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
export const rounded = (x) => (x % 1 === 0.5 ? 2 * Math.round(x / 2) : Math.round(x));  // halves to even, as in Python

const MAX_KEPT = 1024;
const kept = new Map();

// Returns the slices for these diameters of discs, from near to far. shape: as in optics.py.
export function slicesOf(defocusPx, shape) {
    const sharp = NUMBERS.MIN_SPACING_PX / 2, ascending = (values) => Float64Array.from(values).sort();
    const near = ascending(defocusPx.filter((px) => px > sharp));
    const far = ascending(defocusPx.filter((px) => px < -sharp).map((px) => -px));
    const isSharp = near.length + far.length < defocusPx.length || !defocusPx.length;
    for (let factor = 1; ; factor *= NUMBERS.COARSER) {
        const behind = means(far, factor).map((px) => -px);
        const middles = [...means(near, factor).reverse(), ...(isSharp ? [0] : []), ...behind];
        if (middles.length <= NUMBERS.MAX_SLICES) return middles.map((px) => sliceOf(px, shape));
    }
}

// Returns the means of neighbouring values (ascending, positive) that differ by little.
function means(values, factor) {
    const found = [], { MIN_SPACING_PX, SPACING_SHARE } = NUMBERS;
    for (let first = 0; first < values.length;) {
        const end = values[first] + factor * Math.max(MIN_SPACING_PX, SPACING_SHARE * values[first]);
        let last = first, sum = 0;
        while (last < values.length && values[last] <= end) sum += values[last++];
        found.push(sum / (last - first));
        first = last;
    }
    return found;
}

function sliceOf(diameterPx, shape) {
    const { FULL_SIZE_PX, WIDER_A_LEVEL, STEPS_A_TEXEL } = NUMBERS, wider = Math.max(Math.abs(diameterPx) / FULL_SIZE_PX, 1);
    const level = Math.ceil(Math.log(wider) / Math.log(WIDER_A_LEVEL) - 1e-9);
    const texels = rounded(diameterPx / 2 ** level * STEPS_A_TEXEL) / STEPS_A_TEXEL;
    const key = [...Object.values(shape), texels, level > 0].join();
    if (!kept.has(key)) {
        if (kept.size >= MAX_KEPT) kept.clear();
        kept.set(key, discTaps(shape, texels, level > 0));
    }
    const taps = kept.get(key), reach = Math.max(...taps.map(([x, y]) => Math.max(Math.abs(x), Math.abs(y))));
    return { diameterPx, level, taps, reachPx: 2 ** level * (reach + 1) };
}

// Returns the samples of a disc. diameter: in pixels of the size at which it is drawn.
export function discTaps(shape, diameter, isReduced) {
    const { SHARP_PX, SUBSAMPLES } = NUMBERS, alone = [[0, 0, 1]];
    if (Math.abs(diameter) < SHARP_PX) return alone;
    const side = 4 * (Math.floor(Math.ceil(Math.abs(diameter) / 2 + 1.5) / 2) + 1), distance = edgeDistance(shape);
    const place = (i) => ((i + 0.5) / SUBSAMPLES - side / 2 - 0.5) / diameter;
    let covered = new Float64Array(side * side);
    for (let y = 0; y < side * SUBSAMPLES; y++) {
        for (let x = 0; x < side * SUBSAMPLES; x++) {
            const at = side * Math.floor(y / SUBSAMPLES) + Math.floor(x / SUBSAMPLES);
            const inside = distance(place(y), place(x)) * SUBSAMPLES * Math.abs(diameter);
            covered[at] += clamp(0.5 + inside, 0, 1) / SUBSAMPLES ** 2;
        }
    }
    if (isReduced) covered = sharpened(covered, side);
    const taps = [Math.max, Math.min].flatMap((part) => bilinearTaps(covered.map((share) => part(share, 0)), side));
    const total = taps.reduce((sum, [, , weight]) => sum + weight, 0);
    return taps.length ? taps.map(([x, y, weight]) => [x, y, weight / total]) : alone;
}

function sharpened(kernel, side) {
    const at = (i, x, step) => (x + step < 0 || x + step >= side ? 0 : kernel[i] ?? 0);
    return kernel.map((share, i) => {
        const x = i % side, beside = at(i - 1, x, -1) + at(i + 1, x, 1) + at(i - side, x, 0) + at(i + side, x, 0);
        return share - NUMBERS.REDUCTION_BLUR / 2 * (beside - 4 * share);
    });
}

// Returns samples of a kernel of one sign, each with the weights of two by two pixels.
function bilinearTaps(kernel, side) {
    const taps = [];
    for (let y = 0; y < side; y += 2) {
        for (let x = 0; x < side; x += 2) {
            const first = side * y + x, second = first + side;
            const right = kernel[first + 1] + kernel[second + 1], lower = kernel[second] + kernel[second + 1];
            const weight = kernel[first] + kernel[second] + right;
            if (Math.abs(weight) <= NUMBERS.MIN_TAP) continue;
            taps.push([x - side / 2 + right / weight, y - side / 2 + lower / weight, weight]);
        }
    }
    return taps;
}

// Returns a function of a place (t, s): the distance to the edge of an opening of diameter 1, positive inside.
export function edgeDistance({ kind, blades, rotation_deg: turn, ring_inner: inner, roundness: round }) {
    if (kind === "ring") return (t, s) => Math.min(0.5 - Math.hypot(t, s), Math.hypot(t, s) - 0.5 * inner);
    if (kind !== "polygon") return (t, s) => 0.5 - Math.hypot(t, s);
    const half = Math.PI / blades, sides = Array.from({ length: blades }, (_, i) => {
        const angle = turn * Math.PI / 180 + (2 * i + 1) * half;
        return [Math.sin(angle), -Math.cos(angle)];
    });
    return (t, s) => {
        const straight = 0.5 * Math.cos(half) - Math.max(...sides.map(([across, down]) => s * across + t * down));
        return (1 - round) * straight + round * (0.5 - Math.hypot(t, s));
    };
}

// Returns lower end, 1 / width, upper end, 1 / width of the weights of each slice, see viewer/gpu/refocus/discs.py.
export function tentsOf(slices) {
    const middles = [1e6, ...slices.map(({ diameterPx }) => diameterPx), -1e6];
    const tents = slices.map((_, i) => {
        const [near, here, far] = middles.slice(i, i + 3);
        return [far, 1 / (here - far), near, 1 / (near - here)];
    });
    tents[0].splice(2, 2, 2e6, 1);
    tents.at(-1).splice(0, 2, -2e6, 1);
    return tents;
}
