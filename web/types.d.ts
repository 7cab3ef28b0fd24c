// The types that several scripts share, and what pages hold. JSDoc gives the types of functions and of modules' own data.
// Arrays of vectors are flat: (3 N) are N vectors.

type Numbers = ArrayLike<number>;
type NestedBytes = Uint8Array | NestedBytes[];
/** [x, y, z], or red, green, blue from 0 to 1, sRGB. */
type Vector = number[];
type Up = "x" | "y" | "z" | "-x" | "-y" | "-z";

interface Array<T> {
    /** As array[i], which is not undefined for places that exist. */
    at(index: number): T;
}

// Models.

interface Tensor {
    shape: number[];
    values: Float32Array;
}

interface Layer {
    rows: number;
    columns: number;
    /** (rows, columns). */
    weight: Float32Array;
    bias: Float32Array;
}
type Network = Layer[];
interface Bounds {
    [key: string]: number;
    step_bound: number;
    band_step_bound: number;
}
interface Level {
    /** Missing in a scene. */
    network: Network;
    delta: number;
    iterations: number;
    bounds: Bounds;
}
/** What parseModel() reads. */
interface Model {
    name: string;
    inputs: "xyz" | "xyzt";
    /** Azimuth and elevation, degrees. */
    front: number[] | null;
    credit: string;
    levels: Level[];
    /** In a scene: whether it has colors. */
    texture: Network | null;
    /** Number of weights and biases. */
    parameters: number;
    /** Of a scene. */
    field?: PrintedField;
    /** Number of a scene's. */
    shapes?: number;
    /** Whether it is under training. */
    isUnfinished?: boolean;
    /** URL of a picture. */
    poster?: string | null;
}
/** A model on the stage. */
interface ShownModel extends Model {
    /** Height of its lowest point. */
    ground: number;
}
/** Iterations of loops in one evaluation of the field. */
interface Loops {
    /** By level. */
    value: number[];
    /** By level. */
    gradient: number[];
    texture: number;
}
interface PrintedField {
    text: string;
    texels: Float32Array | null;
    /** Of the texture, rows. */
    height: number;
    loops: Loops;
}
/** Points near the surface (3 N), and the field there (N). */
interface Probes {
    points: number[];
    values: number[];
}

// Programs: what a model computes, as a few ops on vectors packed in vec4 (print/lower_model.js).

/** A map that has every name asked for. */
interface Table<Value> extends Map<string, Value> {
    get(name: string | null | undefined): Value;
    has(name: string | undefined): boolean;
}
interface Constant {
    /** A multiple of 4, as columns. */
    rows: number;
    /** 0 for a vector. */
    columns: number;
    /** (rows, columns). */
    values: Float32Array;
}
type Op =
    & {
        result: string;
        source?: string;
        left?: string;
        right?: string;
        matrix?: string;
        bias?: string | null;
        row?: string;
        offset?: number;
    }
    & (
        /** result = matrix source + bias. */
        | {kind: "affine"; source: string; matrix: string}
        /** result = transpose(matrix) source. */
        | {kind: "transposed"; source: string; matrix: string}
        | {kind: "sine" | "cosine"; source: string}
        /** result = left * right. */
        | {kind: "product"; left: string; right: string}
        /** result = dot(row, source) + offset, a scalar. */
        | {kind: "dot"; source: string; row: string; offset: number}
    );
/** A function. */
interface Code {
    name: string;
    ops: Op[];
    outputs: string[];
    /** Numbers of vec4 of values. */
    blocks: Table<number>;
}
interface Lowered {
    constants: Table<Constant>;
    /** Of the levels. */
    values: Code[];
    gradients: Code[];
    texture: Code | null;
}

// The view.

interface Camera {
    /** Degrees. */
    azimuth: number;
    elevation: number;
    /** Model units; null fits the unit sphere. */
    distance: number | null;
    target: readonly number[];
}
interface Options {
    level: number;
    /** null: the same as `level`. */
    normalLevel: number | null;
    shading: string;
    /** Factor on the model's own. */
    iterations: number;
    /** Pixels per pixel of the canvas along each axis. */
    resolution: number | "auto";
    time: number;
    /** Direction in camera space. */
    light: Vector;
    /** Bottom and top. */
    background: Vector[];
}
/** The grids of cells that let rays skip empty space, as `Cells` of field/cells.py. */
interface Cells {
    count: number;
    half: number;
    grids: Uint8Array[];
}
interface Scene {
    model: ShownModel;
    camera: Camera;
    options: Options;
    cells?: Cells | null;
}
interface Program {
    program: WebGLProgram;
    /** Locations of uniforms. */
    names: Record<string, WebGLUniformLocation | null>;
    /** Whether it draws blocks of pixels. */
    inBlocks?: boolean;
}
/** A texture that can be drawn to. */
interface Target {
    texture: WebGLTexture;
    framebuffer: WebGLFramebuffer;
    width: number;
    height: number;
}
/** The model's shader with its weights in one storage. */
interface Variant {
    storage: "texture" | "literal";
    /** By pass. */
    programs: Record<string, Program>;
    /** The texture of the weights. */
    weights: WebGLTexture | null;
    /** Of the field where the driver limits loops. */
    loops: Loops | null;
    /** Milliseconds per pixel, 0 if unknown. */
    cost: number;
    /** Whether it has drawn a whole picture. */
    proven: boolean;
}
/** Callbacks of the renderer. */
interface Listener {
    loaded(): void;
    /** A picture is drawn. settled: whether it is complete. */
    frame(frame: {milliseconds: number; size: number[]; samples: number; settled: boolean}): void;
    /** Part of the first sample of every pixel is drawn. */
    progress(size: number[], share: number): void;
    /** error: of the field; null where it cannot be measured. */
    stored(storage: string, error: number | null): void;
    /** Whether a second variant is being compiled and compared. */
    trying(isTried: boolean): void;
    failed(error: Error): void;
}
/** Draws in a canvas: the renderer, or what stands in for it. */
interface Drawer {
    show(camera: Camera, options: Options, moving: boolean): void;
}

/** three.js, of any release. */
type Three = any;

// What Python writes into pages (web/facts.py, web/page.py, web/studio_page.py).

type PackedFacts =
    & {quarters: number[]}
    & Record<"widest" | "offset" | "bias" | "change" | "weights_of_a_byte" | "most_weights" | "widest_bell", number>
    & Record<"finest" | "coarsest" | "total", number>;
type CellFacts =
    & {counts: {first: number; second: number; last: number}}
    & Record<"first" | "many" | "too_many" | "moments" | "overestimate" | "reach" | "empty" | "missed", number>
    & Record<"lookups", number>;
interface Shared {
    format: {
        name: string;
        version: number;
        widest: number;
        most_iterations: number;
        step_bounds: (keyof Bounds)[];
        default_step_bound: number;
        training: string;
    };
    packed: PackedFacts;
    /** Ending of a file -> what it holds. */
    shapes: Record<string, string>;
    /** Widest layer, and how weights up to it are stored. */
    storages: [number, string][];
    texture_width: number;
    unroll: number;
    plain: string;
    /** Of uniforms. */
    defaults: Record<string, number[]>;
    shadings: string[];
    shading_labels: Record<string, string>;
    shading_keys: Record<string, string>;
    cells: CellFacts;
    samples: {share: number; plenty: number; power: number; steepest: number; block: number};
    period: number;
    /** Steps of a frame, in order, and the pass that each draws. */
    frame: Record<string, string>;
    floor_block: number;
    loop_limit: number;
    softbox_evaluations: number;
    least_steps: number;
    camera: {azimuth: number; elevation: number; fov: number; margin: number; zoom: [number, number]};
}
interface Facts {
    shared: Shared;
    mplicits: string;
    name: string;
    sha256: string;
    front?: number[] | null;
    credit?: string;
    ground: number;
    shade: string;
    storage: string;
    /** Probes. */
    points: number[];
    values: number[];
    scene?: SceneFacts;
    target: string;
    /** Of an ES module. */
    shaders: Record<string, string>;
    old_shades: Record<string, string>;
    poster?: string;
    weights: string;
    /** Pattern of GLSL's words. */
    reserved: string;
    studio: StudioFacts;
}
/** A scene's model without name, front and credit; its field; number of the texels, and bytes of their numbers. */
interface SceneFacts extends Pick<ShownModel, "inputs" | "parameters" | "shapes" | "texture" | "levels"> {
    text: string;
    loops: Loops;
    texels: number;
    size: number;
}
interface StudioFacts {
    config: Config;
    presets: Record<string, {label: string; levels: string; packed: boolean; seconds: number}>;
    preset: string;
    /** Degrees. */
    crease: number;
    /** Settings of every training, for tests. */
    fixed: Partial<Settings> | null;
    omegas: number[];
    omega_width: number;
    /** Width, depth, omega. */
    texture: [number, number, number];
    limits: {width: number; depth: number; levels: number};
    upright: Record<Up, number[][]>;
    endings: string[];
    plain: Vector;
    viewer: Record<"policy" | "accept" | "open" | "hint" | "description", string>;
    tiny: Record<string, string>;
}
type LossWeights = Record<
    "value" | "normal" | "eikonal" | "distance" | "excess" | "lacking" | "length" | "near",
    number
>;
/** `TrainingConfig` of trainer/config.py. */
interface Config {
    loss: {first_level: LossWeights; residual: LossWeights; late: number; late_value: number};
    step: StepConfig;
    sampling: SamplingConfig;
    mining: MiningConfig;
    texture: Record<"batch" | "colors_per_sample" | "rate" | "output_factor" | "smoothness", number>;
    measuring: {points: number; band_points: number; tracing: TracingConfig};
    budget: Record<"residual" | "texture" | "least", number>;
    bend: BendConfig;
}
type StepConfig =
    & Record<"batch" | "rate" | "rate_width" | "output_factor" | "output_factor_per_delta", number>
    & Record<"residual_output", number>;
type SamplingConfig =
    & Record<"largest_pool" | "smallest_pool" | "pool_per_step" | "pool_per_second" | "first_band", number>
    & Record<"first_band_share" | "ball_radius" | "corner_share" | "largest_distance" | "stray_candidates", number>
    & Record<"stray_suspects" | "strays" | "stray_error" | "stray_share", number>;
type MiningConfig =
    & {schedule: number[]}
    & Record<"longest" | "share" | "exact_share" | "first_share" | "candidates" | "first_candidates", number>
    & Record<"first_reach" | "suspects" | "near" | "excess" | "least_distance" | "wrong_sign" | "spread", number>
    & Record<"fewest", number>;
type TracingConfig =
    & Record<"rays" | "rounds" | "worst" | "aside" | "turn" | "inside" | "step_share" | "shortest", number>
    & Record<"longest" | "samples" | "expected_samples" | "least_bound", number>;
type BendConfig = {omegas: number[]} & Record<"points" | "nearest" | "farthest" | "smooth" | "rough", number>;

/** A model on the stage, with what comes back after a lost context. */
interface Current {
    model: ShownModel;
    /** Whether the page opens with it. */
    isOwn?: boolean;
    probes: Probes;
    /** Of the second variant; "texture" without one. */
    storage: string;
    /** Of the model, or "". */
    sha256: string;
    memory: ReturnType<typeof import("./draw/remembered_variant.js").memoryOf>;
    /** The same with all levels; only after the driver failed at them. */
    whole?: Current;
}

// Trainings.

/** A network's size without padding; depth: hidden layers. */
interface Layout {
    width: number;
    depth: number;
}
/** A network's size in the kernel. */
interface KernelNetwork extends Layout {
    outputs: number;
}
interface Settings {
    levels: Layout[];
    texture: Layout;
    /** Of the levels, then of the texture. */
    omegas: number[];
    /** Whether the omegas are the preset's. */
    isUsual: boolean;
    /** Of the levels, then of the texture; null trains for `seconds`. */
    steps: number[] | null;
    seconds: number;
    packed: boolean;
    /** Degrees; null keeps the facets flat. */
    crease: number | null;
    seed: number;
    isOnGpu?: boolean;
}
interface TrainedNetwork {
    network: KernelNetwork;
    layout: Layout;
    /** In the kernel's order. */
    weights: Float32Array;
    steps: number;
    share: number;
    loss: number;
    restarts: number;
    seconds: number;
}
interface TrainedLevel extends TrainedNetwork {
    delta: number;
    lipschitz: number;
    stepBound: number;
    bandStepBound: number;
    meanF: number;
    distance: number;
    angle: number;
}
/** A training's networks. */
interface Trained {
    levels: TrainedLevel[];
    texture: TrainedNetwork | null;
}

// What pages hold beside their scripts.

interface PageElements {
    axes: SVGSVGElement;
    detail: HTMLSelectElement;
    file: HTMLInputElement;
    iterations: HTMLInputElement;
    mesh: HTMLCanvasElement;
    more: HTMLDetailsElement;
    panel: HTMLFormElement;
    pause: HTMLButtonElement;
    play: HTMLButtonElement;
    poster: HTMLImageElement;
    resume: HTMLButtonElement;
    save: HTMLButtonElement;
    settings: HTMLFormElement;
    time: HTMLInputElement;
    trained: HTMLProgressElement;
    view: HTMLCanvasElement;
}
interface ParentNode {
    querySelector<Tag extends keyof HTMLElementTagNameMap>(selectors: Tag): HTMLElementTagNameMap[Tag];
    querySelector<E extends Element = HTMLElement>(selectors: string): E;
}
interface Document {
    /** Pages have the elements that their scripts name. */
    getElementById<K extends string>(id: K): K extends keyof PageElements ? PageElements[K] : HTMLElement;
}
/** The page around a packed page, and its HTML (view/unpacker.js). */
declare var packedPage: {outer: string; html: string};
/** The weights of a tiny page (tiny/unpack.js). */
declare var packed: Uint8Array<ArrayBuffer>;
declare function stop(reason: unknown): void;
/** Of a tiny page: see tiny/draw.js. */
declare const NETWORKS: [
    type: "float" | "vec3",
    name: string,
    layers: [number, number, number, number, number, number[]][],
    outputs: [number, number, number][],
][];
declare const VIEW: [number, number];
/** 0 or 1. */
declare const MOVES: number;
declare const SHADER: string;
declare const GPUBufferUsage: Record<string, number>;
declare const GPUMapMode: Record<string, number>;
