// Shows the picture in a headset (WebXR) as a window that stands upright before the head. The surface in focus lies in
// the window's plane. The cameras lie in a plane DISTANCE_M before it: there a ray from the eye finds its view.

import { ends, hash, pick } from "./lens.js";
import { clamp } from "./slices.js";
import { $, say } from "./views.js";

const DISTANCE_M = 1.5, SIDE_M = 1.2, NEAREST_M = 0.1;  // from the head to the window; its longer side
const EYES_M = 0.063, HEAD_M = 0.1;  // distance between the eyes, and how far the head moves within the grid
const MOST_MARGIN = 0.3;  // share of the picture that is cropped
const MOST_PX = 6e5, MOST_SCALE = 2, OPEN_SCALE = 0.7;  // of an eye's picture, which is drawn in one pass; of an open lens'
const DRAG = 0.03, EASE = 0.2;  // of a hand, in windows, that opens no aperture; share of a change of focus, per frame

const limited = (x, limit) => clamp(x, -limit, limit);

// Returns viewpoint, dolly and the part of the picture along an axis. at, middle: where the ray of the eye, and of the
// place between both, through the window's middle crosses the cameras' plane; side: of the window; all in view steps.
// share: DISTANCE_M, in distances of the eye. shear: how far the surface in focus moves per view step, in pictures.
function axisOf(at, middle, side, share, shear, [low, high]) {
    const reach = Math.min((high - low) / 2, MOST_MARGIN / Math.abs(shear)), aside = limited(at - middle, reach);
    const free = reach - Math.abs(aside), between = limited(middle, free), place = between + aside;
    const turn = limited(side * (1 - share), 2 * (free - Math.abs(between))), scale = 1 - shear * turn;
    const dolly = turn / scale, shown = 1 - 2 * Math.abs(shear) * reach, size = shown * scale;
    const eye = (low + high) / 2 + (1 + dolly * shear) * place;
    return { eye, dolly, shown, start: 0.5 - size / 2 - shear * place, size };
}

// Returns what an eye [x, y, z] sees through the window, whose whole size [width, height] is given; all in m from the
// window's middle. middle: between the eyes. A view step is as long as the grid allows; far surfaces part no eyes.
export function sightOf(field, focus, whole, eye, middle) {
    const { width, height, rowStep, eyeLimits: { t, s }, range: [farthest] } = field;
    const step = Math.max((EYES_M + HEAD_M) / (s[1] - s[0]), (focus - farthest) * whole[0] / width);
    const share = DISTANCE_M / Math.max(eye[2], NEAREST_M);
    const along = (i, m, ...rest) => (
        axisOf(eye[i] * share / m, middle[i] * share / m, whole[i] / Math.abs(m), share, ...rest));
    const across = along(0, step, focus / width, s), down = along(1, -step * rowStep, focus * rowStep / height, t);
    return {
        eye: { t: down.eye, s: across.eye }, dolly: [across.dolly, down.dolly],
        part: { x: across.start, y: down.start, width: across.size, height: down.size },
        size: [across.shown * whole[0], down.shown * whole[1]],
    };
}

// Returns, for each place of the grid, column and row of the nearest view, whether it has disparity, and its layer.
function nearestViews({ rows, columns, step, layers, hasDisparity }) {
    const near = (x, count) => clamp(Math.round((x - (count >> 1)) / step) * step, ...ends(count, step));
    return Float32Array.from(Array.from({ length: rows * columns }, (_, i) => {
        const s = near(i % columns, columns), t = near(Math.floor(i / columns), rows);
        return [s + (columns >> 1), t + (rows >> 1), Number(hasDisparity), layers.get(hash({ t, s }))];
    }).flat());
}

class Headset {
    constructor(page, session, local) {
        const { renderer, field } = page, { gl } = renderer, views = [field.width, field.height];
        Object.assign(this, { page, session, local, focus: page.optics.focus, held: new Map() });
        this.whole = views.map((side) => SIDE_M * side / Math.max(...views));
        const scale = Math.min(MOST_SCALE, Math.sqrt(MOST_PX / views[0] / views[1]));
        this.px = views.map((side) => Math.max(Math.round(scale * side), 1));
        renderer.nearest = renderer.texture(gl.TEXTURE_2D, gl.RGBA32F, gl.NEAREST, field.columns, field.rows);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, field.columns, field.rows, gl.RGBA, gl.FLOAT, nearestViews(field));
        local.addEventListener("reset", () => (this.space = null));
        session.addEventListener("selectstart", ({ frame, inputSource }) => this.select(frame, inputSource));
        session.addEventListener("selectend", ({ inputSource }) => this.held.delete(inputSource));
        session.addEventListener("squeeze", () => page.reset());
    }

    frame(frame) {
        const { page: { field, optics }, session, whole } = this;
        session.requestAnimationFrame((now, next) => this.frame(next));
        this.space ??= this.standing(frame.getViewerPose(this.local));
        const pose = this.space && frame.getViewerPose(this.space);
        if (!pose) return;
        this.focus += EASE * (optics.focus - this.focus);
        const placeOf = ({ transform: { position: { x, y, z } } }) => [x, y, z], head = placeOf(pose);
        this.sight = sightOf(field, this.focus, whole, head, head);
        const pointed = [...session.inputSources].flatMap((hand) => this.pointed(frame, hand));
        for (const view of pose.views) {
            const sight = sightOf(field, this.focus, whole, placeOf(view), head);
            this.draw(view, sight, [...pointed, -1, -1, -1, -1].slice(0, 4));
        }
    }

    // Draws an eye's picture, in one pass, and the window with it.
    draw(view, { eye, dolly, part, size }, pointed) {
        const { page: { renderer, optics }, focus } = this, scale = optics.aperture > 0 ? OPEN_SCALE : 1;
        renderer.begin({ ...optics, eye, focus, dolly }, part, ...this.px.map((side) => Math.round(scale * side)));
        renderer.drawFirst();
        const { transform: { inverse }, projectionMatrix } = view, layer = this.session.renderState.baseLayer;
        const { x, y, width, height } = layer.getViewport(view), { framebuffer } = layer;
        const values = { "to_eye[0]": [...inverse.matrix], "to_clip[0]": [...projectionMatrix], size, pointed };
        const target = { framebuffer, x, y, width, height }, textures = { light_sum: renderer.light };
        renderer.draw(["window.frag"], target, values, textures, "window.vert");
    }

    // Returns the space of a window that stands upright before the head: x right, y up, z towards the head.
    standing(pose) {
        if (!pose) return null;
        const { matrix: m, position: { x, y, z } } = pose.transform, turn = Math.atan2(m[8], m[10]);
        const place = { x: x - DISTANCE_M * Math.sin(turn), y, z: z - DISTANCE_M * Math.cos(turn) };
        const orientation = { x: 0, y: Math.sin(turn / 2), z: 0, w: Math.cos(turn / 2) };
        return this.local.getOffsetReferenceSpace(new XRRigidTransform(place, orientation));
    }

    // Returns the place of the window's plane that a hand points at, from the lower left corner, in windows, or none.
    // Opens the aperture while the hand pinches or holds its trigger and is dragged up.
    pointed(frame, hand) {
        const { page, held, sight } = this, pose = sight && frame.getPose(hand.targetRaySpace, this.space);
        const m = pose?.transform.matrix, far = m ? m[14] / m[10] : 0;
        if (!(far > 0)) return [];
        const place = [0, 1].map((i) => (m[12 + i] - far * m[8 + i]) / sight.size[i] + 0.5);
        const up = place[1] - (held.get(hand) ?? place[1]), drag = up - limited(up, DRAG);
        if (drag) {
            held.set(hand, held.get(hand) + drag);
            page.set({ aperture: page.optics.aperture + drag * page.field.apertureLimits[1] });
        }
        return place;
    }

    // Focuses where a hand points that begins to pinch or to hold its trigger.
    select(frame, hand) {
        const { page: { field }, sight } = this, [across, up] = this.pointed(frame, hand);
        this.held.set(hand, up);
        if (!field.middle || !(Math.min(across, up, 1 - across, 1 - up) >= 0)) return;
        const { eye, dolly, part } = sight, u = part.x + across * part.width, v = part.y + (1 - up) * part.height;
        const from = { t: eye.t + dolly[1] * (v - 0.5), s: eye.s + dolly[0] * (u - 0.5) };
        this.page.set({ focus: pick(field, field.middle, from, u, v) });
    }
}

// Shows the button where there is a headset. A session has the views that are there when it begins.
export async function offerHeadset() {
    $("headset").hidden = !await navigator.xr?.isSessionSupported("immersive-vr").catch(() => false);
}

// The page rests until the session ends; pressed again, the button ends it.
export async function enterHeadset(page) {
    if (page.session) return page.session.end();
    try {
        const session = page.session = await navigator.xr.requestSession("immersive-vr"), { gl } = page.renderer;
        session.addEventListener("end", () => {
            page.session = null;
            page.wake();
        });
        await gl.makeXRCompatible();
        session.updateRenderState({ baseLayer: new XRWebGLLayer(session, gl, { depth: false }) });
        const headset = new Headset(page, session, await session.requestReferenceSpace("local"));
        return session.requestAnimationFrame((now, frame) => headset.frame(frame));
    } catch (error) {
        page.session?.end();
        return say(`The headset shows nothing: ${error.message}.`);
    }
}
