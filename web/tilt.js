// Turns of a device that a hand holds, from the events of its orientation.

import { clamp } from "./slices.js";

const NOISE_DEG = 0.4;  // Largest turn that leaves the picture as it is.

// Returns where a device's right, top and front point to in the world: W3C's angles, Z-X'-Y''.
function axesOf(event) {
    const turns = [event.alpha, event.beta, event.gamma].map((angle) => angle * Math.PI / 180);
    const [[ca, sa], [cb, sb], [cg, sg]] = turns.map((angle) => [Math.cos(angle), Math.sin(angle)]);
    return [
        [ca * cg - sa * sb * sg, sa * cg + ca * sb * sg, -cb * sg], [-sa * cb, ca * cb, sb],
        [ca * sg + sa * sb * cg, sa * sg - ca * sb * cg, cb * cg],
    ];
}

// Reads how far the screen's front turns between events, in degrees down and right; noise turns nothing.
export class Tilt {
    // screenAngle: of the screen's content in the device, degrees; where it changes, the reading starts again.
    turn(event, screenAngle) {
        const [right, top, front] = axesOf(event);
        if (this.angle !== screenAngle) {
            const angle = screenAngle * Math.PI / 180, [c, s] = [Math.cos(angle), Math.sin(angle)];
            const mixed = (x, y) => right.map((_, i) => x * right[i] + y * top[i]);
            Object.assign(this, { angle: screenAngle, axes: [mixed(-s, -c), mixed(c, -s)], turned: [0, 0] });
        }
        const [t, s] = this.axes.map((axis, i) => {
            const sine = axis.reduce((sum, x, k) => sum + x * front[k], 0);
            const ahead = Math.asin(clamp(sine, -1, 1)) * 180 / Math.PI - this.turned[i];
            const beyond = ahead - clamp(ahead, -NOISE_DEG, NOISE_DEG);
            this.turned[i] += beyond;
            return beyond;
        });
        return { t, s };
    }
}
