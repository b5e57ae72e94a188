// Draws a light field through a lens, by the desktop's shaders in WebGL 2.

import { Discs } from "./discs.js";
import { fraction, hash, lensOf, passCount, samplesOf } from "./lens.js";
import { NUMBERS } from "./slices.js";

// Returns a program, and functions that set its uniforms, by name.
function linked(gl, vertex, fragment) {
    const program = gl.createProgram(), uniforms = new Map();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
        const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
        throw new Error(`${gl.getProgramInfoLog(program)} ${logs.join(" ")}`);
    }
    const puts = {
        [gl.FLOAT]: "uniform1fv", [gl.FLOAT_VEC2]: "uniform2fv", [gl.FLOAT_VEC3]: "uniform3fv", [gl.FLOAT_VEC4]: "uniform4fv",
        [gl.UNSIGNED_INT]: "uniform1uiv", [gl.INT_VEC2]: "uniform2iv", [gl.INT_VEC4]: "uniform4iv",
    };
    for (let i = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
        const { name, type } = gl.getActiveUniform(program, i), put = puts[type] ?? "uniform1iv";  // integers, samplers
        const place = gl.getUniformLocation(program, name);
        if (place) uniforms.set(name, (value) => gl[put](place, [value].flat()));
    }
    return { program, uniforms };
}

export class Renderer {
    constructor(canvas, shaders, field) {
        const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true });
        const isFloat = Boolean(gl?.getExtension("EXT_color_buffer_float"));
        if (!isFloat && !gl?.getExtension("EXT_color_buffer_half_float")) throw new Error("no WebGL 2 that draws half floats");
        Object.assign(this, { isFloat, gl, canvas, shaders, field, programs: new Map(), sheets: {}, hidden: null });
        if ("drawingBufferColorSpace" in gl) gl.drawingBufferColorSpace = field.colorSpace;
        const side = Math.max(field.width, field.height);
        if (side > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new Error(`no textures of ${side} pixels`);
        gl.disable(gl.DITHER);
        gl.blendFunc(gl.ONE, gl.ONE);
        const { width, height, order: { length: layers } } = field;
        this.colors = this.texture(gl.TEXTURE_2D_ARRAY, gl.RGBA8, gl.LINEAR, width, height, layers);
        this.table = new Float32Array(3 * NUMBERS.MAX_SAMPLES * 4);
        this.samples = gl.createBuffer();
        this.discs = new Discs(this);
        this.rootOf = Uint8Array.from({ length: 256 }, (_, i) => {  // square root of linear light, see srgb.glsl
            const x = i / 255, light = x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
            return Math.round(Math.sqrt(light) * 255);
        });
    }

    // Returns a texture with its target and size.
    texture(target, format, filter, width, height, layers = 0) {
        const { gl } = this, texture = gl.createTexture();
        gl.bindTexture(target, texture);
        if (layers) gl.texStorage3D(target, 1, format, width, height, layers);
        else gl.texStorage2D(target, 1, format, width, height);
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, filter);
        for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
        return { target, texture, width, height };
    }

    // Returns a texture of this name to draw into, with its framebuffer: another texture if the size has changed, which
    // an atlas may exceed. together: sheets that one pass draws. Row 0 comes first.
    sheet(name, format, width, height, together = [name]) {
        const { gl, sheets } = this, before = sheets[name], isAtlas = name === "slices" || name === "blurred";
        const fits = (has, needs) => (isAtlas ? has >= needs : has === needs);
        if (before && fits(before.width, width) && fits(before.height, height)) return before;
        const framebuffer = (sheets[together[0]] ?? before)?.framebuffer ?? gl.createFramebuffer();
        gl.deleteTexture(before?.texture ?? null);
        const sheet = this.texture(gl.TEXTURE_2D, format, isAtlas ? gl.LINEAR : gl.NEAREST, width, height);
        const attachments = together.map((_, i) => gl.COLOR_ATTACHMENT0 + i), place = attachments[together.indexOf(name)];
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, place, gl.TEXTURE_2D, sheet.texture, 0);
        gl.drawBuffers(attachments);
        return (sheets[name] = { ...sheet, framebuffer });
    }

    // Clears a sheet, or the lower left part of this size.
    clear({ framebuffer, width, height }, size = [width, height]) {
        const { gl } = this;
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(0, 0, ...size);
        gl.clear(gl.COLOR_BUFFER_BIT);
        gl.disable(gl.SCISSOR_TEST);
    }

    // Stores a view, or the hidden surface after the last one. rgba: bytes, sRGB-encoded; alpha is the disparity in the
    // range of the field. Overwrites rgba.
    upload(layer, rgba) {
        const { gl, field: { width, height, order, range: [far, near] }, rootOf } = this;
        const isHidden = layer === order.length, disparity = isHidden && new Float32Array(width * height);
        for (let i = 0; i < rgba.length; i += 4) {
            rgba[i] = rootOf[rgba[i]];
            rgba[i + 1] = rootOf[rgba[i + 1]];
            rgba[i + 2] = rootOf[rgba[i + 2]];
            if (!isHidden) continue;
            disparity[i / 4] = far + (near - far) * rgba[i + 3] / 255;
            rgba[i + 3] = 255;
        }
        const place = [0, 0, width, height], bytes = [gl.RGBA, gl.UNSIGNED_BYTE, rgba];
        if (isHidden) {
            const colors = this.texture(gl.TEXTURE_2D, gl.RGBA8, gl.LINEAR, width, height);
            gl.texSubImage2D(gl.TEXTURE_2D, 0, ...place, ...bytes);
            const behind = this.texture(gl.TEXTURE_2D, gl.R32F, gl.NEAREST, width, height);
            gl.texSubImage2D(gl.TEXTURE_2D, 0, ...place, gl.RED, gl.FLOAT, disparity);
            this.hidden = { colors, disparity: behind };
        } else {
            gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.colors.texture);
            gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, width, height, 1, ...bytes);
        }
    }

    // Draws with a program: a fragment shader and its switches. values, textures: of uniforms and samplers by name; those
    // that the compiler left out are skipped. count: number of points; without it, the whole target.
    draw([fragment, ...switches], { framebuffer, x = 0, y = 0, width, height }, values, textures, vertex = "fullscreen.vert", count = 0) {
        const { gl, shaders } = this, names = switches.filter(Boolean), key = [vertex, fragment, ...names].join(" ");
        if (!this.programs.has(key)) {
            const defines = names.map((name) => `#define ${name} 1\n`).join("");
            const source = (name) => shaders["preamble.glsl"] + defines + shaders[name];
            this.programs.set(key, linked(gl, source(vertex), source(fragment)));
        }
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.viewport(x, y, width, height);
        const { program, uniforms } = this.programs.get(key);
        gl.useProgram(program);
        Object.entries(textures).filter(([name]) => uniforms.has(name)).forEach(([name, { target, texture }], unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(target, texture);
            uniforms.get(name)(unit);
        });
        for (const [name, value] of Object.entries(values)) uniforms.get(name)?.(value);
        if (count) gl.drawArrays(gl.POINTS, 0, count);
        else gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);  // the fourth corner of fullscreen.vert lies outside
    }

    // ---- Pictures: sums of passes, which an open lens then blurs. See accumulation.py, passes.py and picture_renderer.py

    // Begins a picture. optics: see lens.js; dolly: its own in view steps per picture size, if any.
    begin(optics, part, width, height, level = NUMBERS.LEVELS[0]) {
        const { gl, field } = this, lens = lensOf(optics, field, Math.round(width / part.width), level);
        const { marginPx: margin, focus, tilt, range } = lens, { range: [farthest, nearest] } = field;
        const region = { width: width + 2 * margin, height: height + 2 * margin }, passes = passCount(lens, field);
        const across = part.width / width, down = part.height / height;
        const values = {
            part: [part.x - margin * across, part.y - margin * down, region.width * across, region.height * down],
            pixel_uv: [across, down], field_part: [0, 0, 1, 1], view_size_px: [field.width, field.height],
            view_step: [1, field.rowStep], farthest, nearest, focus_disparity: focus, focus_tilt: tilt,
            focus_range: range, highlight_gain: lens.gain, dolly: lens.dolly ?? [0, 0],
            eye_in_grid: [lens.eye.s + (field.columns >> 1), lens.eye.t + (field.rows >> 1)],
        };
        // Half floats end at 65504 and are coarse near 0, where surfaces lie that no view sees: weights add up to about
        // half of their range. Powers of two keep the sum exact.
        const gain = 2 ** (15 - Math.ceil(Math.log2(passes * (1 + lens.gain))));
        this.picture = { lens, part, width, height, region, values, passes, gain, pass: 0 };
        this.clear(this.sheet("pinhole", gl.RGBA16F, region.width, region.height));
    }

    // Draws the picture that was begun, in steps. isQuick: the first step shows the first pass.
    *steps(isQuick) {
        const { picture } = this;
        if (isQuick) {
            this.drawFirst();
            this.present();
            yield;
        }
        if (isQuick && picture.passes === 1) return;
        while (picture.pass < picture.passes) {
            this.pass();
            if (!picture.lens.slices.length) this.present();
            yield;
        }
        if (!picture.lens.slices.length) return;
        yield* this.open();
        this.present();
    }

    // Draws the first pass as the lens sees it.
    drawFirst() {
        this.pass();
        for (const _ of this.open());
    }

    // Opens the lens, in steps: blurs the sum of passes.
    *open() {
        const { gl, picture, picture: { lens, region, width, height } } = this;
        if (!lens.slices.length) return;
        this.clear(this.sheet("seen", gl.R16F, region.width, region.height));
        this.pass(true);
        const opened = this.sheet("opened", gl.RGBA16F, width, height);
        yield* this.discs.steps(picture, opened);
    }

    // Returns the sheet of the light, weighted by alpha.
    get light() {
        return this.picture.lens.slices.length ? this.sheets.opened : this.sheets.pinhole;
    }

    // Shows the picture on the canvas, which gets its size.
    present() {
        const { gl, canvas, picture: { width, height } } = this;
        if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
        const values = { exposure: 1, part: [0, 0, 1, 1] };
        this.draw(["present.frag"], { framebuffer: null, width, height }, values, { light_sum: this.light });
        gl.flush();
    }

    // Returns a function that says whether all that has been drawn is done.
    mark() {
        const { gl } = this, sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        return () => {
            const isDone = gl.isContextLost() || gl.getSyncParameter(sync, gl.SYNC_STATUS) === gl.SIGNALED;
            if (isDone) gl.deleteSync(sync);
            return isDone;
        };
    }

    // Adds a pass to the picture of the pinhole, or draws the disparity that it shows.
    pass(isDisparity = false) {
        const { gl, field, picture, picture: { lens, values } } = this, samples = samplesOf(lens, field, isDisparity);
        const mostPx = field.layers.size > 1 ? NUMBERS.NEAR_PX : NUMBERS.ALONE_NEAR_PX;
        const isNear = !lens.dolly && samples.every(({ t, s, view }) => {
            const dt = view.t - lens.eye.t - t, ds = view.s - lens.eye.s - s;
            const px = Math.hypot(field.rowStep * dt, ds) * (field.range[1] - field.range[0]);
            return px <= mostPx && Math.max(Math.abs(dt), Math.abs(ds)) <= field.step;
        });
        const warp = field.hasDisparity && ["WARP", isNear && "NEAR"];
        const switches = [warp, lens.dolly && "DOLLY", lens.gain > 0 && "HIGHLIGHTS", isDisparity && "SEEN"].flat();
        this.setSamples(samples);
        gl.enable(gl.BLEND);
        this.draw(["lens.frag", ...switches], this.sheets[isDisparity ? "seen" : "pinhole"], {
            ...values, sample_count: samples.length,
        }, { colors: this.colors, nearest_views: this.nearest });
        gl.disable(gl.BLEND);
        if (!isDisparity) picture.pass++;
    }

    setSamples(samples) {
        const { MAX_SAMPLES, OFF_BORDER_PX, SQRT_STEPS } = NUMBERS;
        const { gl, table, field: { layers, hasDisparity }, picture: { lens, gain, pass } } = this;
        const within = SQRT_STEPS.slice(3).map((step) => fraction(pass, step) - 0.5 + OFF_BORDER_PX);
        samples.forEach(({ t, s, view, weight, answer }, i) => {
            table.set([s, t, ...within], 4 * i);
            table.set(answer ?? [view.s - lens.eye.s - s, view.t - lens.eye.t - t, 0], 4 * (MAX_SAMPLES + i));
            table.set([layers.get(hash(view)), Number(hasDisparity), gain * weight, 0], 4 * (2 * MAX_SAMPLES + i));
        });
        gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.samples);
        gl.bufferData(gl.UNIFORM_BUFFER, table, gl.DYNAMIC_DRAW);
    }
}
