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

/** Reads a .safetensors model. Rejects with an Error whose message names the file. */
export function loadModel(url: string | URL, signal?: AbortSignal | null): Promise<Model>;

export interface CameraOrbit {
    /** Azimuth, radians. */
    theta: number;
    /** Angle from the upward axis, radians. */
    phi: number;
    /** Distance, model units. */
    radius: number;
}

/** Events of <mplicits-view>. */
export interface MplicitsViewEventMap extends Omit<HTMLElementEventMap, "load" | "error"> {
    load: CustomEvent<{url: string}>;
    /** preventDefault() keeps the message away from the view and the console. */
    error: CustomEvent<{type: "loadfailure" | "webglcontextlost"; sourceError: Error}>;
    "poster-dismissed": CustomEvent<{}>;
    "camera-change": CustomEvent<{source: "user-interaction" | "automatic"}>;
}

/** <mplicits-view>. Properties that are not readonly, except currentTime, are attributes: cameraOrbit is camera-orbit. */
export class MplicitsView extends HTMLElement {
    src: string | null;
    model: string | null;
    alt: string | null;
    poster: string | null;
    loading: string | null;
    reveal: string | null;
    shade: string | null;
    /** Last level to draw, from 1; null: all. */
    level: number | null;
    background: string | null;
    cameraOrbit: string | null;
    cameraControls: boolean;
    disableZoom: boolean;
    disablePan: boolean;
    touchAction: string | null;
    /** Seconds of a turn. */
    turntable: number | null;
    autoRotate: boolean;
    rotationPerSecond: string | null;
    autoplay: boolean;
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
    addEventListener<Type extends keyof MplicitsViewEventMap>(
        type: Type, listener: (this: MplicitsView, event: MplicitsViewEventMap[Type]) => void,
        options?: boolean | AddEventListenerOptions,
    ): void;
    addEventListener(
        type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions,
    ): void;
    removeEventListener<Type extends keyof MplicitsViewEventMap>(
        type: Type, listener: (this: MplicitsView, event: MplicitsViewEventMap[Type]) => void,
        options?: boolean | EventListenerOptions,
    ): void;
    removeEventListener(
        type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | EventListenerOptions,
    ): void;
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
