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
    const { WIDEST_TEXELS, STEPS_A_TEXEL } = NUMBERS;
    const level = Math.max(Math.floor(Math.log2(Math.max(Math.abs(diameterPx), 1e-9) / WIDEST_TEXELS)) + 1, 0);
    const texels = rounded(diameterPx / 2 ** level * STEPS_A_TEXEL) / STEPS_A_TEXEL;
    const key = [...Object.values(shape), texels, level > 0].join();
    if (!kept.has(key)) {
        if (kept.size >= MAX_KEPT) kept.clear();
        kept.set(key, discTaps(shape, texels, level > 0));
    }
    const taps = kept.get(key), reach = Math.max(...taps.map(([x, y]) => Math.max(Math.abs(x), Math.abs(y))));
    return { diameterPx, level, taps, reach, reachPx: 2 ** level * (reach + 1) };
}

// Returns the samples of a disc. diameter: in pixels of the size at which it is drawn.
export function discTaps(shape, diameter, isReduced) {
    const { SHARP_PX, SUBSAMPLES, REDUCTION_BLUR } = NUMBERS, alone = [[0, 0, 1]];
    if (Math.abs(diameter) < SHARP_PX) return alone;
    const across = diameter * Math.sqrt(1 - (isReduced ? REDUCTION_BLUR / diameter ** 2 : 0));
    const half = 2 * (Math.floor(Math.ceil(Math.abs(across) / 2 + 0.5) / 2) + 1);
    const place = (i) => ((i + 0.5) / SUBSAMPLES - half - 0.5) / across;
    const covered = new Float64Array(4 * half * half), distance = edgeDistance(shape);
    for (let y = 0; y < 2 * half * SUBSAMPLES; y++) {
        for (let x = 0; x < 2 * half * SUBSAMPLES; x++) {
            const at = 2 * half * Math.floor(y / SUBSAMPLES) + Math.floor(x / SUBSAMPLES);
            const inside = distance(place(y), place(x)) * SUBSAMPLES * Math.abs(across);
            covered[at] += clamp(0.5 + inside, 0, 1) / SUBSAMPLES ** 2;
        }
    }
    const taps = [];
    let total = 0;
    for (let row = 0; row < half; row++) {
        for (let column = 0; column < half; column++) {
            const first = 4 * half * row + 2 * column, second = first + 2 * half;
            const right = covered[first + 1] + covered[second + 1], lower = covered[second] + covered[second + 1];
            const weight = covered[first] + covered[second] + right;
            total += weight;
            if (weight > 1e-4) taps.push([2 * column - half + right / weight, 2 * row - half + lower / weight, weight]);
        }
    }
    return taps.length ? taps.map(([x, y, weight]) => [x, y, weight / total]) : alone;
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
