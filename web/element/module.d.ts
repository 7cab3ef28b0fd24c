/** A model: of this module, or of a file. */
export interface Model {
    readonly name: string;
    readonly credit: string;
    /** "xyz", or "xyzt" for a model that moves. */
    readonly inputs: "xyz" | "xyzt";
    readonly levels: readonly unknown[];
    readonly parameters: number;
    /** Height of the lowest point, model units. */
    readonly ground: number;
}

/** Returns the model in this module. */
export function ownModel(): Model;

/** Reads a .safetensors model. */
export function loadModel(url: string | URL, signal?: AbortSignal | null): Promise<Model>;

export interface CameraOrbit {
    /** Azimuth, radians. */
    theta: number;
    /** Angle from the upward axis, radians. */
    phi: number;
    /** Distance, model units. */
    radius: number;
}

/**
 * <mplicits-view>. Attributes: src, model, alt, poster, loading, reveal, camera-controls, disable-zoom, disable-pan,
 * camera-orbit, turntable, auto-rotate, rotation-per-second, autoplay, shade, level, background.
 * Events: load, error, poster-dismissed, camera-change.
 */
export class MplicitsView extends HTMLElement {
    readonly loaded: boolean;
    readonly modelIsVisible: boolean;
    readonly paused: boolean;
    /** Time of a moving model, from 0 to 1. */
    currentTime: number;
    play(): void;
    pause(): void;
    getCameraOrbit(): CameraOrbit | null;
    dismissPoster(): void;
    showPoster(): void;
    /** The refined picture, a PNG. */
    toBlob(): Promise<Blob>;
}

export interface MeshOptions {
    /** By default the model of this module. */
    model?: Model;
    /** Color of a model without a texture: a THREE.Color, or what its constructor takes. */
    color?: unknown;
    /** Last level to draw. */
    level?: number;
    time?: number;
}

/** Properties that createMesh adds to a THREE.Mesh. */
export interface ModelMesh {
    level: number;
    time: number;
    dispose(): void;
}

/** Returns a THREE.Mesh whose fragments trace rays against the model. THREE: the library. */
export function createMesh<Three extends {Mesh: abstract new (...values: any) => any}>(
    THREE: Three, options?: MeshOptions,
): InstanceType<Three["Mesh"]> & ModelMesh;

declare global {
    interface HTMLElementTagNameMap {
        "mplicits-view": MplicitsView;
    }
}
