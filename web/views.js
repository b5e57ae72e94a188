// Reads the pictures of the views that a page carries, and hands them to the renderer.

import { hash } from "./renderer.js";

export const $ = (id) => document.getElementById(id);
export const say = (text) => ($("status").textContent = text);

// The pictures of a data element in their order: a line is a file, which may hold many frames.
async function* pictures(element, type, isMoving) {
    for (const line of element.textContent.trim().split("\n")) {
        const data = Uint8Array.from(atob(line), (letter) => letter.charCodeAt(0));
        if (!isMoving || !await globalThis.ImageDecoder?.isTypeSupported(type)) {
            yield await createImageBitmap(new Blob([data], { type }));  // of a moving picture the first frame
            continue;
        }
        const decoder = new ImageDecoder({ data, type, preferAnimation: true });
        await decoder.tracks.ready;
        await decoder.completed;
        for (let i = 0; i < decoder.tracks.selectedTrack.frameCount; i++) {
            yield (await decoder.decode({ frameIndex: i })).image;
        }
        decoder.close();
    }
}

// Stores all views; `onView` hears of each. The middle one is shown alone until all are there.
export async function load(field, renderer, onView) {
    const { width, height, order, colorSpace } = field;
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true, colorSpace });
    const pixels = (image) => {
        context.drawImage(image, 0, 0, width, height);
        image.close();
        return context.getImageData(0, 0, width, height).data;
    };
    const depths = field.hasDisparity && pictures($("depths"), field.type, field.isMoving);
    let layer = 0;
    for await (const image of pictures($("colors"), field.type, field.isMoving)) {
        const colors = pixels(image), depth = depths ? pixels((await depths.next()).value) : null;
        renderer.upload(layer, colors, depth);
        if (layer === 0 && depth) field.middle = Uint8Array.from({ length: width * height }, (_, i) => depth[4 * i]);
        onView(++layer);
    }
    if (layer < order.length) return say("This browser shows one view and its depth: it lacks ImageDecoder.");
    order.forEach((place, i) => field.layers.set(hash(place), i));
    field.step = field.fullStep;
    return say("");
}
