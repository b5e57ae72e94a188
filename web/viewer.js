// The page: moves the lens by touch, mouse and keys.

import { enterHeadset, offerHeadset } from "./headset.js";
import { WHOLE, pick } from "./lens.js";
import { Renderer } from "./renderer.js";
import { NUMBERS, clamp } from "./slices.js";
import { Tilt } from "./tilt.js";
import { $, load, say } from "./views.js";

const SWING_S = 9, MOST_SWINGS = 3, BAR_AWAY_MS = 4000, HINT_MS = 6000, MOST_ZOOM = 16, FOCUS_STEPS = 50;
const TAP_MS = 350, TAP_PX = 8, DOUBLE_TAP_PX = 30;  // Longest time between two taps; movement within one; between two.
const LINE_PX = 33, NOTCH_PX = 100;  // Scrolling by a line, and by a notch of a plain wheel.
const TILT_DEG = 20;  // Turn of a device that leads to the outermost view.
const DETAIL = 2, MOST_SIDE_PX = 4096;  // Largest number of drawn pixels: for a pixel of a view; of the longer side.
const CLOSED_STOPS = 6;  // Length of the aperture's slider in stops, from the widest to a pinhole.
const SLOW_MS = 45, QUICK_MS = 24;  // Time of a frame, while the hand moves, above and below which quality changes.
const CLOSING_MS = 400;  // Time of the coarsest frame from which on the lens stays closed while the hand moves.

function hint(text) {
    say(text);
    setTimeout(() => say(""), HINT_MS);
}

class Page {
    constructor(field) {
        const canvas = $("view"), still = matchMedia("(prefers-reduced-motion: reduce)").matches;
        Object.assign(this, { field, canvas, part: WHOLE, level: 0, isClosing: false, changed: true, drawnAt: 0, moves: 0 });
        this.optics = { eye: { t: 0, s: 0 }, ...field.optics };
        this.swings = !still && field.order.length > 1;
        this.pointers = new Map();
        this.focusStep = (field.focusLimits[1] - field.focusLimits[0]) / FOCUS_STEPS;
        const limits = { focus: field.focusLimits, aperture: [0, CLOSED_STOPS], range: field.rangeLimits, highlights: [0, 1] };
        for (const [name, ends] of Object.entries(limits)) {
            [$(name).min, $(name).max] = ends;
            $(name).addEventListener("input", () => {
                const value = $(name).valueAsNumber;
                this.set({ [name]: name === "aperture" ? this.opened(value) : value });
            });
        }
        $("shape").addEventListener("change", ({ target: { value } }) => {
            const [kind, blades] = value.split(" "), { shape } = this.optics;
            this.set({ shape: { ...shape, kind, blades: Number(blades) || shape.blades } });
        });
        new ResizeObserver(() => this.wake()).observe(canvas);
        canvas.addEventListener("lostpointercapture", ({ pointerId }) => this.pointers.delete(pointerId));
        for (const name of ["pointerdown", "pointermove", "pointerup", "wheel"]) {
            canvas.addEventListener(name, (event) => this[name](event), { passive: false });
        }
        document.addEventListener("keydown", (event) => this.keydown(event));
        // A finger shows the bar only after its tap: a button that came up under it would take the click.
        document.addEventListener("pointermove", ({ pointerType }) => pointerType === "touch" || this.showBar());
        for (const name of ["click", "keydown", "input"]) document.addEventListener(name, () => this.showBar());
        $("bar").addEventListener("click", ({ target }) => this[target.dataset.do]?.());
        $("actions").addEventListener("click", () => $("actions").hidePopover?.());
        $("tilt").hidden = !globalThis.DeviceOrientationEvent || !matchMedia("(pointer: coarse)").matches;
        $("full").hidden = !document.fullscreenEnabled;
        this.showBar();
    }

    // Changes the optics; a hand's change ends the swing.
    set(changes, isHand = true) {
        const { eyeLimits: { t, s }, focusLimits, apertureLimits, rangeLimits } = this.field;
        const wanted = { ...this.optics, ...changes };
        this.swings &&= !isHand || !Object.keys(changes).length;
        this.optics = {
            eye: { t: clamp(wanted.eye.t, ...t), s: clamp(wanted.eye.s, ...s) },
            focus: clamp(wanted.focus, ...focusLimits), aperture: clamp(wanted.aperture, ...apertureLimits),
            range: clamp(wanted.range, ...rangeLimits), highlights: clamp(wanted.highlights, 0, 1),
            shape: wanted.shape, tilt: wanted.tilt,
        };
        const { aperture, shape: { kind, blades } } = this.optics;
        for (const [name, words] of Object.entries(this.words())) {
            $(name).value = name === "aperture" ? this.stops(aperture) : this.optics[name];
            $(name).setAttribute("aria-valuetext", words);
        }
        $("shape").value = kind === "polygon" ? `polygon ${blades}` : kind;
        $("stop").value = aperture ? this.fNumber() : "all sharp";
        this.wake();
    }

    // Returns the place of an aperture on its slider, and the aperture at a place: in stops, as on the ring of a lens.
    stops(aperture) {
        return aperture ? Math.max(CLOSED_STOPS + Math.log2(aperture / this.field.apertureLimits[1]), 0) : 0;
    }

    opened(stops) {
        return stops > 0 ? this.field.apertureLimits[1] * 2 ** (Math.min(stops, CLOSED_STOPS) - CLOSED_STOPS) : 0;
    }

    fNumber() {
        const { field: { unitFNumber: unit, isExactFNumber }, optics: { aperture } } = this;
        return unit ? `${isExactFNumber ? "" : "≈ "}f/${(unit / aperture).toFixed(1)}` : `${aperture.toFixed(1)} views`;
    }

    // Returns what a screen reader says of each slider.
    words() {
        const { focus, aperture, range, highlights } = this.optics, [far, near] = this.field.focusLimits;
        const percent = (part, whole = 1) => `${Math.round(100 * part / (whole || 1))} %`;
        return {
            focus: `${percent(focus - far, near - far)} of the way from far to near, disparity ${focus.toFixed(2)} pixels`,
            aperture: aperture ? this.fNumber() : "closed, everything is sharp",
            range: range ? `± ${percent(range, near - far)} of the depth` : "none",
            highlights: percent(highlights),
        };
    }

    wake() {
        this.changed = true;
        document.documentElement.dataset.state = "drawing";
        this.asked ||= requestAnimationFrame((now) => this.frame(now));
    }

    frame(now) {
        const { renderer } = this;
        this.asked = 0;
        if (this.session || renderer.gl.isContextLost()) return;  // a headset shows the picture
        if (!this.isDone()) {  // what waits for the graphics card would only come later
            this.asked ||= requestAnimationFrame((next) => this.frame(next));
            return;
        }
        if (this.isMoving) this.adapt(now - this.drawnAt);
        this.isMoving = false;
        if (this.swings) this.swing(now);
        if (this.changed || (now - this.drawnAt > 150 && !this.isBest)) {
            // As good as there is time for while the hand moves, the best once it rests.
            const { LEVELS } = NUMBERS, level = LEVELS[this.changed ? this.level : 0];
            const optics = this.changed && this.isClosing ? { ...this.optics, aperture: 0 } : this.optics;
            renderer.begin(optics, this.part, ...this.size(level.scale), level);
            this.steps = renderer.steps(this.changed);
            this.isBest = level === LEVELS[0] && optics === this.optics;
            Object.assign(this, { drawnAt: now, isMoving: this.changed, changed: false });
        }
        const { done } = this.steps.next();
        this.isDone = renderer.mark();
        if (done && this.isBest && !this.swings) {
            document.documentElement.dataset.state = "still";
            return;
        }
        this.asked ||= requestAnimationFrame((next) => this.frame(next));
    }

    // Takes the time of a frame that was drawn while the hand moved.
    adapt(took) {
        const last = NUMBERS.LEVELS.length - 1;
        this.isClosing ||= took > CLOSING_MS && this.level === last && this.optics.aperture > 0;
        this.level = clamp(this.level + (took > SLOW_MS) - (took < QUICK_MS), 0, last);
    }

    swing(now) {
        const turns = (now - (this.swungAt ??= now)) / 1000 / SWING_S, { t, s } = this.field.eyeLimits;
        const angle = 2 * Math.PI * Math.min(turns, MOST_SWINGS);
        this.swings = turns < MOST_SWINGS;
        this.set({ eye: { t: 0.2 * t[1] * Math.sin(2 * angle), s: 0.6 * s[1] * Math.sin(angle) } }, false);
    }

    // Returns the picture's box on the canvas, CSS pixels.
    box() {
        const { width, height } = this.canvas.getBoundingClientRect(), { field } = this;
        const scale = Math.min(width / field.width, height / field.height);
        const [w, h] = [scale * field.width, scale * field.height];
        return { left: (width - w) / 2, top: (height - h) / 2, width: w, height: h };
    }

    // Returns width and height of the drawn picture. scale: 1, or less for speed.
    size(scale) {
        const { width, height } = this.box(), { field } = this;
        const most = Math.min(DETAIL * Math.max(field.width, field.height), MOST_SIDE_PX);
        const ratio = scale * Math.min(devicePixelRatio, most / Math.max(width, height, 1));
        return [width, height].map((side) => Math.max(Math.round(side * ratio), 1));
    }

    // Returns a place of the canvas in the whole picture, 0..1.
    place({ x, y }) {
        const { left, top, width, height } = this.box(), { part } = this;
        const [across, down] = [(x - left) / width, (y - top) / height];
        return { u: part.x + across * part.width, v: part.y + down * part.height };
    }

    pointerdown(event) {
        if (event.button !== 0) return;
        this.canvas.setPointerCapture(event.pointerId);
        this.pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
        this.moves = this.pointers.size > 1 ? Infinity : 0;
    }

    pointermove({ pointerId, offsetX: x, offsetY: y }) {
        const before = this.pointers.get(pointerId), { width, height } = this.box();
        if (!before) return;
        const [dx, dy] = [x - before.x, y - before.y];
        const [other] = [...this.pointers].filter(([id]) => id !== pointerId).map(([, place]) => place);
        this.moves += Math.hypot(dx, dy);
        this.pointers.set(pointerId, { x, y });
        if (other) {
            const apart = (place) => Math.max(Math.hypot(place.x - other.x, place.y - other.y), 1);
            const middle = { x: (x + other.x) / 2, y: (y + other.y) / 2 };
            this.zoom(apart({ x, y }) / apart(before), middle, dx / 2 / width, dy / 2 / height);
        } else if (this.moves > TAP_PX && this.moves < Infinity) {  // the finger left of a pinch moves nothing
            const { eye } = this.optics, { columns, rows } = this.field;
            this.set({ eye: { t: eye.t - dy / height * rows, s: eye.s - dx / width * columns } });
        }
    }

    pointerup({ pointerId, pointerType, timeStamp, offsetX: x, offsetY: y }) {
        if (!this.pointers.delete(pointerId) || this.moves > TAP_PX) return;
        const { last } = this, { u, v } = this.place({ x, y });
        const isSecond = last?.pointerType === pointerType && timeStamp - last.timeStamp < TAP_MS
            && Math.hypot(x - last.x, y - last.y) < DOUBLE_TAP_PX;
        this.last = isSecond ? null : { pointerType, timeStamp, x, y };
        if (isSecond) return this.reset();
        if (!this.field.middle || u < 0 || v < 0 || u >= 1 || v >= 1) return;
        const focus = pick(this.field, this.field.middle, this.optics.eye, u, v);
        this.set({ focus, aperture: this.optics.aperture || this.field.firstAperture });
    }

    wheel(event) {
        if (parent !== window && !document.hasFocus()) return;  // the page around this one scrolls
        event.preventDefault();
        const notches = event.deltaY * [1, LINE_PX, this.canvas.clientHeight][event.deltaMode] / NOTCH_PX;
        if (event.ctrlKey) this.zoom(Math.exp(-notches / 2), { x: event.offsetX, y: event.offsetY });
        else this.set({ focus: this.optics.focus - notches * this.focusStep });
    }

    // Enlarges about a place, and moves by a share of what is seen.
    zoom(factor, about, right = 0, down = 0) {
        const { x, y, width } = this.part, { u, v } = this.place(about), size = clamp(width / factor, 1 / MOST_ZOOM, 1);
        const moved = (from, at, by) => clamp(at + (from - at) * size / width - by * size, 0, 1 - size);
        this.part = size === 1 ? WHOLE : { x: moved(x, u, right), y: moved(y, v, down), width: size, height: size };
        this.set({ eye: this.optics.eye });
    }

    keydown(event) {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const { optics: { eye, focus, aperture }, focusStep: step } = this;
        const { canvas: { clientWidth, clientHeight } } = this, middle = { x: clientWidth / 2, y: clientHeight / 2 };
        const far = event.shiftKey ? 1 : 0.25, focused = (steps) => () => this.set({ focus: focus + steps * step });
        const opened = (stops) => () => this.set({ aperture: this.opened(this.stops(aperture) + stops) });
        const moved = (t, s) => () => this.set({ eye: { t: eye.t + far * t, s: eye.s + far * s } });
        const ofPicture = {
            ArrowLeft: moved(0, -1), ArrowRight: moved(0, 1), ArrowUp: moved(-1, 0), ArrowDown: moved(1, 0),
            PageUp: () => this.zoom(1.25, middle), PageDown: () => this.zoom(0.8, middle), Home: () => this.reset(),
        };
        const ofPage = {
            "+": focused(1), "=": focused(1), "-": focused(-1),
            "]": opened(0.5), "[": opened(-0.5),
            f: () => event.repeat || this.full(), s: () => event.repeat || this.save(), r: () => this.reset(),
        };
        const action = ofPage[event.key.toLowerCase()] ?? (event.target.type !== "range" && ofPicture[event.key]);
        if (!action) return;
        action();
        event.preventDefault();
    }

    showBar() {
        $("bar").classList.remove("away");
        clearTimeout(this.leaving);
        this.leaving = setTimeout(() => $("bar").classList.add("away"), BAR_AWAY_MS);
    }

    reset() {
        this.part = WHOLE;
        this.set({ eye: { t: 0, s: 0 }, ...this.field.optics });
    }

    full() {
        if (document.fullscreenElement) document.exitFullscreen();
        else document.documentElement.requestFullscreen?.().catch(() => hint("The browser refuses full screen here."));
    }

    save() {
        this.canvas.toBlob((blob) => {
            const link = document.createElement("a");
            Object.assign(link, { href: URL.createObjectURL(blob), download: `${document.title}.png` });
            document.body.append(link);  // Safari saves by no link outside the document
            link.click();
            link.remove();
            setTimeout(() => URL.revokeObjectURL(link.href), 60000);  // people may be asked for a place
        });
    }

    lens = () => $("lens").showPopover?.();
    headset = () => enterHeadset(this);

    // Starts or stops moving the viewpoint by the device's tilt.
    async tilt() {
        const isOn = () => $("tilt").getAttribute("aria-pressed") === "true";
        $("tilt").setAttribute("aria-pressed", !isOn());
        removeEventListener("deviceorientation", this.tilted);
        this.reading = new Tilt();
        if (!isOn()) return;
        const answer = await DeviceOrientationEvent.requestPermission?.().catch(() => "denied") ?? "granted";
        if (answer === "granted" && isOn()) return addEventListener("deviceorientation", this.tilted);
        $("tilt").setAttribute("aria-pressed", false);
        if (answer !== "granted") hint("The browser does not share the device's tilt: allow it, then press Tilt.");
    }

    // Moves the viewpoint by as much as the device turned since the last event.
    tilted = (event) => {
        if (event.beta === null) return;
        const { t, s } = this.reading.turn(event, screen.orientation?.angle ?? 0), { eye } = this.optics;
        const { t: [, bottom], s: [, right] } = this.field.eyeLimits;
        if (t || s) this.set({ eye: { t: eye.t - t / TILT_DEG * bottom, s: eye.s - s / TILT_DEG * right } });
    };
}

async function start() {
    if (!$("end")) return say("This page is cut off: get the whole file.");
    const stored = JSON.parse($("field").textContent), shaders = JSON.parse($("shaders").textContent);
    Object.assign(NUMBERS, stored.numbers);
    const canvas = $("view");
    let page = null, newest = null;
    // Opens the views, and opens them again when the graphics driver lost what it had.
    const open = async () => {
        const field = { ...stored, fullStep: stored.step, step: 1e6, layers: new Map([["0,0", 0]]) };
        let renderer = null;
        try {
            renderer = newest = new Renderer(canvas, shaders, field);
        } catch (error) {
            return say(`The middle picture only: this browser draws no WebGL 2 (${error.message}).`);
        }
        await load(field, renderer, (count) => {
            if (renderer !== newest) return;
            page ??= new Page(field);
            if (count === 1) {  // the middle view shows alone until all are there
                Object.assign(page, { field, renderer, isDone: () => true, isMoving: false });
                canvas.hidden = false;
                page.set({});
            }
            document.documentElement.dataset.views = count;
        });
        page?.wake();
        return offerHeadset();
    };
    canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();  // else the browser does not restore it
        canvas.hidden = true;
        say("The graphics driver stopped. If this message stays, load the page again.");
    });
    canvas.addEventListener("webglcontextrestored", open);
    return open();
}

if (globalThis.document) start();
