// An orbit camera around the unit sphere of model space, and its text in the URL's hash.
// {azimuth, elevation: degrees; distance: model units, null for one that fits the unit sphere; target: [x, y, z]}
export const HOME = Object.freeze({azimuth: 30, elevation: 20, distance: null, target: Object.freeze([0, 0, 0])});
const FOV = 35, MARGIN = 1.06;
export const FOCAL = 1 / Math.tan(FOV * Math.PI / 360);

function away(camera, aspect) {
    return camera.distance ?? MARGIN / Math.sin(Math.atan(Math.min(1, aspect) / FOCAL));
}

// Columns right, up, back, eye, as GL reads a mat4.
export function matrix(camera, aspect) {
    const a = camera.azimuth * Math.PI / 180, e = camera.elevation * Math.PI / 180;
    const right = [Math.cos(a), 0, -Math.sin(a)];
    const up = [-Math.sin(e) * Math.sin(a), Math.cos(e), -Math.sin(e) * Math.cos(a)];
    const back = [Math.cos(e) * Math.sin(a), Math.sin(e), Math.cos(e) * Math.cos(a)];
    const distance = away(camera, aspect);
    const eye = camera.target.map((c, i) => c + distance * back[i]);
    return [...right, 0, ...up, 0, ...back, 0, ...eye, 1];
}

export function orbited(camera, azimuth, elevation) {
    const turned = ((camera.azimuth + azimuth) % 360 + 360) % 360;
    return {...camera, azimuth: turned, elevation: Math.min(90, Math.max(-90, camera.elevation + elevation))};
}

export function zoomed(camera, factor, aspect) {
    return {...camera, distance: Math.min(100, Math.max(0.05, away(camera, aspect) * factor))};
}

// Target moved by shares of the picture's height along its axes.
export function panned(camera, right, up, aspect) {
    const m = matrix(camera, aspect), height = 2 * away(camera, aspect) / FOCAL;
    return {...camera, target: camera.target.map((c, i) => c + height * (right * m[i] + up * m[4 + i]))};
}

export function toHash(camera) {
    const short = (x) => String(Number(x.toFixed(3)));
    const parts = [`az=${short(camera.azimuth)}`, `el=${short(camera.elevation)}`];
    if (camera.distance !== null) parts.push(`d=${short(camera.distance)}`);
    if (camera.target.some((c) => Math.abs(c) > 5e-4)) parts.push(`at=${camera.target.map(short).join(",")}`);
    return `#${parts.join("&")}`;
}

// What a hash says of the camera; what is missing or out of range is as at HOME.
export function fromHash(hash) {
    const given = new URLSearchParams(hash.replace(/^#/, ""));
    const read = (key, least, most) => {
        const value = Number(given.get(key) || NaN);
        return value >= least && value <= most ? value : null;
    };
    const target = (given.get("at") ?? "").split(",").map(Number);
    return {
        azimuth: read("az", -360, 360) ?? HOME.azimuth, elevation: read("el", -90, 90) ?? HOME.elevation,
        distance: read("d", 0.05, 100),
        target: target.length === 3 && target.every((c) => Math.abs(c) <= 100) ? target : [...HOME.target],
    };
}
