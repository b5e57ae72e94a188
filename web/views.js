// Reads the views that a page carries, and hands them to the renderer: streams of VP9 (web_streams.py), or moving
// pictures in AVIF.

import { hash } from "./lens.js";

export const $ = (id) => document.getElementById(id);
export const say = (text) => ($("status").textContent = text);

const RATE = 25, SEEK_MS = 10000, SAMPLE_SIZE = 8192;
const VP9 = { codec: "vp09.00.51.08", hardwareAcceleration: "prefer-software", optimizeForLatency: true };
const bytesOf = (name) => Uint8Array.from(atob($(name).textContent), (letter) => letter.charCodeAt(0));

// RGBA of a picture, enlarged to `scaled`, or of its upper left part.
function drawn(image, width, height, colorSpace, scaled = []) {
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true, colorSpace });
    context.drawImage(image, 0, 0, ...scaled);
    return context.getImageData(0, 0, width, height).data;
}

// The frames of a stream by WebCodecs. Chunks are given no faster than the decoder takes them.
async function* decoded(name, chunks) {
    const data = bytesOf(name), frames = [];
    let wake = null;
    const output = (frame) => {
        frames.push(frame);
        wake?.();
    };
    const decoder = new VideoDecoder({ output, error: () => wake?.() });
    decoder.ondequeue = () => wake?.();
    decoder.configure(VP9);
    for (const [i, [begin, size]] of chunks.entries()) {
        const chunk = { type: i ? "delta" : "key", timestamp: i, data: data.subarray(begin, begin + size) };
        decoder.decode(new EncodedVideoChunk(chunk));  // throws after an error
        while (decoder.decodeQueueSize && !frames.length) await new Promise((done) => (wake = done));
        while (frames.length) yield frames.shift();
    }
    await decoder.flush();
    while (frames.length) yield frames.shift();
    decoder.close();
}

// The frames of a stream by an element that is stepped, where there is no WebCodecs: on pages by plain http, too.
async function* stepped(name, chunks) {
    const video = document.createElement("video"), file = new Blob([bytesOf(name)], { type: "video/webm" });
    const after = (event, changes, frame = Promise.resolve()) => new Promise((done, fail) => {
        Object.assign(video, { [event]: () => frame.then(done), onerror: fail, ...changes });
        const late = () => (document.hidden ? setTimeout(late, SEEK_MS) : fail(new Error("the video stands still")));
        setTimeout(late, SEEK_MS);  // a page in the background waits: it gets no frames
    });
    await after("onloadeddata", { muted: true, playsInline: true, preload: "auto", src: URL.createObjectURL(file) });
    for (const i of chunks.keys()) {
        const frame = new Promise((done) => video.requestVideoFrameCallback?.(done) ?? done());
        await after("onseeked", { currentTime: (i + 0.5) / RATE }, frame);
        yield video;
    }
    URL.revokeObjectURL(video.src);
}

// Returns how many levels too dark luma is drawn: 2 in WebKitGTK.
function missingLevels() {
    if (!globalThis.VideoFrame) return 0;
    const size = { codedWidth: 2, codedHeight: 2 }, luma85 = Uint8Array.of(89, 89, 89, 89, 128, 128);
    const frame = new VideoFrame(luma85, { format: "I420", timestamp: 0, ...size }), [drawn85] = drawn(frame, 1, 1);
    frame.close();
    return 85 - drawn85;
}

// The frames of a stream as levels 0 to 255, from a luma of 16 to 235: by `copyTo` where that gives luma, as drawing is
// less exact. All frames are written into one array.
function levelsReader(frames, width, height) {
    const levels = new Uint8ClampedArray(width * height);
    let planes = new Uint8Array(0), missing;
    return async () => {
        const frame = (await frames.next()).value;
        if (/^(I420|NV12)/.test(frame.format)) {
            if (planes.length < frame.allocationSize()) planes = new Uint8Array(frame.allocationSize());
            const [{ offset, stride }] = await frame.copyTo(planes);
            for (let i = 0, row = offset; i < levels.length; row += stride) {
                for (let x = 0; x < width; x++) levels[i++] = (planes[row + x] - 16) * 255 / 219;
            }
        } else {
            const pixels = drawn(frame, width, height);
            missing ??= missingLevels();
            for (let i = 0; i < levels.length; i++) levels[i] = pixels[4 * i] + missing;
        }
        frame.close?.();  // a video has none
        return levels;
    };
}

// Views of streams as RGBA, alpha: disparity, all in one array. Colours are as in JPEG.
async function* viewsOfStreams({ chunks, width, height }, framesOf) {
    const readers = Object.entries(chunks).map(([name, places], i) => (
        levelsReader(framesOf(name, places), width, i === 1 ? 2 * height : height)));
    const rgba = new Uint8ClampedArray(4 * width * height);
    for (let count = chunks.luma.length; count--;) {
        const [luma, chroma, disparity] = await Promise.all(readers.map((next) => next()));
        for (let i = 0, at = 0; i < luma.length; i++) {
            const y = luma[i], blue = chroma[i] - 128, red = chroma[luma.length + i] - 128;
            rgba[at++] = y + 1.402 * red;
            rgba[at++] = y - 0.344136 * blue - 0.714136 * red;
            rgba[at++] = y + 1.772 * blue;
            rgba[at++] = disparity?.[i];
        }
        yield rgba;
    }
}

// The frames of a picture in AVIF; the first alone where the browser has no ImageDecoder.
async function* framesOfPicture(name) {
    const data = bytesOf(name), type = "image/avif";
    if (!globalThis.ImageDecoder) return yield await createImageBitmap(new Blob([data], { type }));
    const decoder = new ImageDecoder({ data, type });
    await decoder.tracks.ready;
    await decoder.completed;
    for (let i = 0; i < decoder.tracks.selectedTrack.frameCount; i++) {
        yield (await decoder.decode({ frameIndex: i })).image;
    }
    return decoder.close();
}

// Views of pictures as RGBA, alpha: disparity. A page with streams has such pictures of the middle view only.
async function* viewsOfPictures({ hasDisparity, width, height, colorSpace }) {
    const depths = hasDisparity && framesOfPicture("depths");
    for await (const image of $("colors") ? framesOfPicture("colors") : [$("first")]) {
        const rgba = drawn(image, width, height, colorSpace, [width, height]);
        const levels = depths && drawn((await depths.next()).value, width, height);
        for (let at = 3; levels && at < rgba.length; at += 4) rgba[at] = levels[at - 3];
        yield rgba;
    }
}

// Returns some disparities of the middle view, the least and the greatest among them.
function sampleOf({ middle, range: [far, near] }) {
    const step = Math.max(Math.floor(middle.length / SAMPLE_SIZE), 1), levels = middle.filter((_, i) => i % step === 0);
    const ends = [Math.min, Math.max].map((end) => middle.reduce((one, other) => end(one, other)));
    return [...levels, ...ends].map((level) => far + (near - far) * level / 255);
}

// Stores all views and the hidden surface; `onView` hears of each. The middle view is shown alone until all are there.
export async function load(field, renderer, onView) {
    const { order, chunks, layers, hasDisparity } = field;
    const streams = chunks.luma ? [decoded, stepped].map((frames) => viewsOfStreams(field, frames)) : [];
    let count = 0;
    for (const views of [...streams, viewsOfPictures(field)]) {
        count = 0;
        try {
            for await (const rgba of views) {
                if (!count && hasDisparity) {
                    field.middle = rgba.filter((_, i) => i % 4 === 3);
                    field.sample = sampleOf(field);
                }
                renderer.upload(count, rgba);
                onView(Math.min(++count, order.length));
            }
            break;
        } catch (error) {
            console.warn(error);
        }
    }
    if (count < order.length) return say("This browser shows one view and its depth: it cannot decode the others.");
    order.forEach((place, i) => layers.set(hash(place), i));
    field.step = field.fullStep;
    return say("");
}
