// The lights of a scene of three.js, for hull_color.frag.glsl.
export const MOST_LIGHTS = 4;

/** Returns the uniforms. Without any light in the scene, one shines from the upper left of the z axis. renderer: its
 * light counts pi times as much in releases, or settings, that are not physically correct.
 * @param {Three} THREE @param {Three} scene @param {Three} renderer */
export function lightsOf(THREE, scene, renderer = null) {
    const toward = [], shine = [], ambient = new THREE.Color(0), sky = new THREE.Color(0), below = new THREE.Color(0);
    const overhead = new THREE.Vector3(0, 1, 0), share = renderer && isLegacy(renderer) ? 1 : 1 / Math.PI;
    const bright = (/** @type {Three} */ color, /** @type {number} */ intensity) =>
        color.clone().multiplyScalar(intensity * share);
    let count = 0;
    scene?.traverseVisible((/** @type {Three} */ light) => {
        if (!light.isLight) return;
        ++count;
        const {color, intensity} = light, at = new THREE.Vector3().setFromMatrixPosition(light.matrixWorld);
        if (light.isAmbientLight) ambient.add(bright(color, intensity));
        if (light.isHemisphereLight) {
            overhead.copy(at).normalize();
            sky.add(bright(color, intensity));
            below.add(bright(light.groundColor, intensity));
        }
        if (!light.isDirectionalLight || toward.length === MOST_LIGHTS) return;
        toward.push(at.sub(new THREE.Vector3().setFromMatrixPosition(light.target.matrixWorld)).normalize());
        shine.push(bright(color, intensity));
    });
    if (scene && !count) {
        ambient.setScalar(0.3);
        toward.push(new THREE.Vector3(-0.4, 0.6, 0.7).normalize());
        shine.push(new THREE.Color(0.8, 0.8, 0.8));
    }
    while (toward.length < MOST_LIGHTS) {
        toward.push(new THREE.Vector3(0, 1, 0));
        shine.push(new THREE.Color(0));
    }
    return {toward, shine, ambient, overhead, sky, ground_light: below};
}

/** @param {Three} renderer */
function isLegacy({useLegacyLights, physicallyCorrectLights}) {
    return useLegacyLights ?? (physicallyCorrectLights === undefined ? false : !physicallyCorrectLights);
}
