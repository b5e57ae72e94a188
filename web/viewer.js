// The page: moves the lens by touch, mouse and keys.

import { enterHeadset, offerHeadset } from "./headset.js";
import { NUMBERS, Renderer, WHOLE, clamp, pick } from "./renderer.js";
import { $, load, say } from "./views.js";

const SWING_S = 9, BAR_AWAY_MS = 4000, TAP_MS = 350, TAP_PX = 8, TILT_DEG = 20, MOST_ZOOM = 16, MOST_SIDE_PX = 4096;
const SLOW_MS = 45, QUICK_MS = 24;  // of a frame while the hand moves

class Page {
    constructor(field) {
        const canvas = $("view"), still = matchMedia("(prefers-reduced-motion: reduce)").matches;
        Object.assign(this, { field, canvas, part: WHOLE, level: 0, changed: true, drawnAt: 0, moves: 0 });
        this.optics = { eye: { t: 0, s: 0 }, focus: field.focus, aperture: field.aperture };
        this.swings = !still && field.order.length > 1;
        this.pointers = new Map();
        for (const name of ["focus", "aperture"]) {
            [$(name).min, $(name).max] = field[`${name}Limits`];
            $(name).addEventListener("input", () => this.set({ [name]: $(name).valueAsNumber }));
        }
        new ResizeObserver(() => this.wake()).observe(canvas);
        canvas.addEventListener("pointercancel", ({ pointerId }) => this.pointers.delete(pointerId));
        for (const name of ["pointerdown", "pointermove", "pointerup", "wheel"]) {
            canvas.addEventListener(name, (event) => this[name](event), { passive: false });
        }
        document.addEventListener("keydown", (event) => this.keydown(event));
        document.addEventListener("pointermove", () => this.showBar());
        for (const button of document.querySelectorAll("button")) {
            button.addEventListener("click", () => this[button.dataset.do]());
        }
        $("tilt").hidden = !globalThis.DeviceOrientationEvent || !matchMedia("(pointer: coarse)").matches;
        offerHeadset();
        this.showBar();
    }

    // Draws by this renderer from now on: the first one, or the one that follows when the graphics driver lost its data.
    use(field, renderer) {
        Object.assign(this, { field, renderer });
        this.canvas.hidden = false;
        this.set({});
    }

    // Changes the optics; a hand's change ends the swing.
    set(changes, isHand = true) {
        const { eyeLimits: { t, s }, focusLimits, apertureLimits } = this.field;
        const wanted = { ...this.optics, ...changes };
        this.swings &&= !isHand || !Object.keys(changes).length;
        this.optics = {
            eye: { t: clamp(wanted.eye.t, ...t), s: clamp(wanted.eye.s, ...s) },
            focus: clamp(wanted.focus, ...focusLimits), aperture: clamp(wanted.aperture, ...apertureLimits),
        };
        for (const name of ["focus", "aperture"]) $(name).value = this.optics[name];
        this.wake();
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
        if (this.swings) this.swing(now);
        const rests = now - this.drawnAt > 150;
        if (this.changed || (this.level && rests && !this.isBest)) {
            // As good as there is time for while the hand moves, the best once it rests.
            const took = now - this.drawnAt, { width, height } = this.size();
            const change = this.changed && took < 400 ? (took > SLOW_MS) - (took < QUICK_MS) : 0;
            this.level = clamp(this.level + change, 0, NUMBERS.LEVELS.length - 1);
            const level = NUMBERS.LEVELS[this.changed ? this.level : 0];
            const [w, h] = [width, height].map((side) => Math.max(Math.round(side * level.scale), 1));
            renderer.begin(this.optics, this.part, w, h, level);
            this.isBest = level === NUMBERS.LEVELS[0];
            [this.drawnAt, this.changed] = [now, false];
            renderer.step();
        } else if (!renderer.isComplete) {
            renderer.step();
        } else if (this.isBest && !this.swings) {
            document.documentElement.dataset.state = "still";
            return;
        }
        this.asked ||= requestAnimationFrame((next) => this.frame(next));
    }

    swing(now) {
        const turn = 2 * Math.PI * now / 1000 / SWING_S, { t, s } = this.field.eyeLimits;
        this.set({ eye: { t: 0.2 * t[1] * Math.sin(2 * turn), s: 0.6 * s[1] * Math.sin(turn) } }, false);
    }

    // The picture's box on the canvas, CSS pixels, and its size on the screen.
    box() {
        const { width, height } = this.canvas.getBoundingClientRect(), { field } = this;
        const scale = Math.min(width / field.width, height / field.height);
        const [w, h] = [scale * field.width, scale * field.height];
        return { left: (width - w) / 2, top: (height - h) / 2, width: w, height: h };
    }

    size() {
        const { width, height } = this.box();
        const ratio = Math.min(devicePixelRatio, MOST_SIDE_PX / Math.max(width, height, 1));
        return { width: Math.max(Math.round(width * ratio), 1), height: Math.max(Math.round(height * ratio), 1) };
    }

    // Where in the whole picture, 0..1.
    place({ offsetX, offsetY }) {
        const { left, top, width, height } = this.box(), { part } = this;
        const [across, down] = [(offsetX - left) / width, (offsetY - top) / height];
        return { u: part.x + across * part.width, v: part.y + down * part.height };
    }

    pointerdown(event) {
        this.canvas.setPointerCapture(event.pointerId);
        this.pointers.set(event.pointerId, event);
        this.moves = this.pointers.size > 1 ? Infinity : 0;
    }

    pointermove(event) {
        const before = this.pointers.get(event.pointerId), { width, height } = this.box();
        if (!before) return;
        const [dx, dy] = [event.offsetX - before.offsetX, event.offsetY - before.offsetY];
        const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, one]) => one);
        this.moves += Math.hypot(dx, dy);
        this.pointers.set(event.pointerId, event);
        if (other) {
            const apart = (one) => Math.hypot(one.offsetX - other.offsetX, one.offsetY - other.offsetY);
            const [offsetX, offsetY] = [(event.offsetX + other.offsetX) / 2, (event.offsetY + other.offsetY) / 2];
            this.zoom(apart(event) / Math.max(apart(before), 1), { offsetX, offsetY }, dx / 2 / width, dy / 2 / height);
        } else if (this.moves > TAP_PX) {
            const { eye } = this.optics, { columns, rows } = this.field;
            this.set({ eye: { t: eye.t - dy / height * rows, s: eye.s - dx / width * columns } });
        }
    }

    pointerup(event) {
        this.pointers.delete(event.pointerId);
        if (this.moves > TAP_PX) return;
        const isSecond = event.timeStamp - (this.tappedAt ?? -Infinity) < TAP_MS, { u, v } = this.place(event);
        this.tappedAt = isSecond ? -Infinity : event.timeStamp;
        if (isSecond) return this.reset();
        if (!this.field.middle || u < 0 || v < 0 || u >= 1 || v >= 1) return;
        const focus = pick(this.field, this.field.middle, this.optics.eye, u, v);
        this.set({ focus, aperture: this.optics.aperture || this.field.firstAperture });
    }

    wheel(event) {
        event.preventDefault();
        const [low, high] = this.field.focusLimits, turned = Math.sign(event.deltaY);
        if (event.ctrlKey) this.zoom(Math.exp(-event.deltaY / 200), event);
        else this.set({ focus: this.optics.focus - turned * (high - low) / 50 });
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
        this.showBar();
        const { eye, focus, aperture } = this.optics, [low, high] = this.field.focusLimits;
        const onSlider = event.target.type === "range", far = event.shiftKey ? 1 : 0.25, step = (high - low) / 50;
        const moved = (t, s) => !onSlider && this.set({ eye: { t: eye.t + far * t, s: eye.s + far * s } });
        const done = {
            ArrowLeft: () => moved(0, -1), ArrowRight: () => moved(0, 1), ArrowUp: () => moved(-1, 0),
            ArrowDown: () => moved(1, 0), "+": () => this.set({ focus: focus + step }),
            "-": () => this.set({ focus: focus - step }), "]": () => this.set({ aperture: aperture + 0.5 }),
            "[": () => this.set({ aperture: aperture - 0.5 }), f: () => this.full(), s: () => this.save(),
            r: () => this.reset(), Home: () => onSlider || this.reset(),
        }[event.key];
        done?.();
        if (done && !onSlider) event.preventDefault();
    }

    showBar() {
        $("bar").classList.remove("away");
        clearTimeout(this.leaving);
        this.leaving = setTimeout(() => $("bar").classList.add("away"), BAR_AWAY_MS);
    }

    reset() {
        this.part = WHOLE;
        this.set({ eye: { t: 0, s: 0 }, focus: this.field.focus, aperture: this.field.aperture });
    }

    full() {
        if (document.fullscreenElement) document.exitFullscreen();
        else document.documentElement.requestFullscreen?.().catch(() => say("This place allows no full screen."));
    }

    save() {
        this.canvas.toBlob((blob) => {
            const link = document.createElement("a");
            Object.assign(link, { href: URL.createObjectURL(blob), download: `${document.title}.png` }).click();
            setTimeout(() => URL.revokeObjectURL(link.href), 10000);
        });
    }

    headset() {
        enterHeadset(this);
    }

    async tilt() {
        const asked = await DeviceOrientationEvent.requestPermission?.().catch(() => "denied") ?? "granted";
        if (asked !== "granted") return say("The device does not tell how it is held.");
        let from = null;
        return addEventListener("deviceorientation", ({ beta, gamma }) => {
            from ??= { beta, gamma };
            const { t, s } = this.field.eyeLimits;
            this.set({ eye: { t: (from.beta - beta) / TILT_DEG * t[1], s: (from.gamma - gamma) / TILT_DEG * s[1] } });
        });
    }
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
        return load(field, renderer, (count) => {
            if (renderer !== newest) return;
            page ??= new Page(field);
            page.use(field, renderer);
            document.documentElement.dataset.views = count;
        }).catch((error) => say(`The views cannot be read: ${error.message}.`)).finally(() => page?.wake());
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
