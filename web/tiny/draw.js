// The script of a tiny page (web/tiny_page.py). NETWORKS, VIEW, MOVES and SHADER are filled in; `packed` is of
// unpack.js. A network is [type, name, layers, outputs]; a layer [rows, columns, half of its weights, half of its
// biases, step, factors of the input], an output [half, step, offset].

// Returns the next whole numbers of the weights, as web/tiny_page.py writes them: nothing for zeros, one byte each, or
// all high bytes before all low bytes.
let at = packed.indexOf(0) + 1;
/** @param {number} count @param {number} half */
function numbers(count, half) {
    const size = half && 1 + /** @type {any} */ (half > 127), from = at;
    at += size * count;
    const signed = (/** @type {number} */ k) => packed[from + k] << 24 >> 24;
    return Array.from(
        {length: count},
        (_, k) => (size > 1 ? 256 * signed(k) + packed[from + count + k] : size && signed(k)),
    );
}

/** Returns the sum of products of a layer's rows with the input. rows: 4 gives mat4, 1 gives vec4.
 * @param {number[]} matrix @param {number} columns @param {number} row @param {number} rows */
const sum = (matrix, columns, row, rows) =>
    Array.from({length: columns / 4}, (_, i) => {
        const block = Array.from(
            {length: 4 * rows},
            (_, k) => matrix[(row + k % rows) * columns + 4 * i + (k / rows | 0)],
        );
        return rows > 1 ? `mat4(${block})*x[${i}]` : `dot(vec4(${block}),x[${i}])`;
    }).join("+");

const functions = NETWORKS.map(([type, name, layers, outputs]) => {
    let text = `${type} ${name}(vec4 p){vec4 x[16],y[16];x[0]=p*vec4(${layers[0][5]});`, width = 0;
    for (const [rows, columns, half, halfBias, step] of layers) {
        const matrix = numbers(rows * columns, half), biases = numbers(rows, halfBias);
        for (let row = 0; row < rows; row += 4) {
            text += `y[${row / 4}]=sin(${step}*(vec4(${biases.slice(row, row + 4)})+${sum(matrix, columns, row, 4)}));`;
        }
        text += "x=y;";
        width = rows;
    }
    const values = outputs.map(([half, step, offset]) =>
        `${step}*(${sum(numbers(width, half), width, 0, 1)})+${offset}`
    );
    return `${text}return ${type}(${values});}`;
}).join("");

// Draws: coarse pixels in `buffer`, stretched over the canvas, while the view changes; then rows of fine pixels, from the
// middle up and down, straight into the canvas. Their numbers follow the device, at some 50 ms for each coarse picture or
// group of rows, or part of a row. The first picture has 1,000 pixels: a driver resets a GPU that draws for seconds.
const [label] = document.body.childNodes, canvas = document.createElement("canvas");
const gl = /** @type {WebGL2RenderingContext} */ (
    canvas.getContext("webgl2", {antialias: false, preserveDrawingBuffer: true})
);
const place = (/** @type {string} */ name) => gl.getUniformLocation(program, name);
canvas.style.cssText = "position:fixed;inset:0;width:100%;height:100%;z-index:-1;touch-action:none;pointer-events:auto";
let [azimuth, elevation] = VIEW, zoom = 1;
let turns = /** @type {any} */ (!matchMedia("(prefers-reduced-motion:reduce)").matches);
const moves = MOVES && turns, light = /** @type {any} */ (matchMedia("(prefers-color-scheme:light)").matches) * .6;
// drawn: 0, or 1 + fine rows above the middle; column: where the next begins.
let /** @type {WebGLProgram} */ program,
    /** @type {WebGLFramebuffer} */ buffer,
    /** @type {WebGLRenderbuffer} */ pixels;
let /** @type {WebGLSync | null} */ fence,
    /** @type {number | boolean} */ isAsked,
    /** @type {number | boolean} */ isRough;
let /** @type {number} */ scale,
    /** @type {number} */ rows,
    /** @type {number} */ column,
    /** @type {number} */ drawn,
    last = 0;
let steady = 99; // pieces since the context was lost; a whole picture is many

function start() {
    document.body.style.cssText =
        "margin:9px;overflow:hidden;color-scheme:light dark;color:canvastext;font:13px system-ui;pointer-events:none";
    document.body.replaceChildren(label, canvas);
    try {
        program = gl.createProgram();
        for (
            const [kind, text] of /** @type {[number, string][]} */ ([
                [
                    gl.VERTEX_SHADER,
                    "#version 300 es\nvoid main(){gl_Position=vec4(gl_VertexID%2*4-1,gl_VertexID/2*4-1,0,1);}",
                ],
                [gl.FRAGMENT_SHADER, SHADER.replace("@", functions)],
            ])
        ) {
            const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
            gl.shaderSource(shader, text);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw 0;
    } catch { // no context, no shader, or none that the driver takes
        return stop(gl ? "the graphics driver refuses the shader" : "WebGL 2 is missing");
    }
    gl.useProgram(program);
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer = gl.createFramebuffer());
    gl.bindRenderbuffer(gl.RENDERBUFFER, pixels = gl.createRenderbuffer());
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, pixels);
    gl.enable(gl.SCISSOR_TEST);
    isRough = true;
    fence = scale = 0;
    (onresize = fit)();
}

function fit() {
    canvas.width = innerWidth * devicePixelRatio;
    canvas.height = innerHeight * devicePixelRatio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, canvas.width, canvas.height);
    redraw();
}

/** Draws a rectangle, from pixel (left, from) on, of a picture.
 * @param {WebGLFramebuffer | null} target @param {number} width @param {number} height @param {number} left
 * @param {number} from @param {number} columns @param {number} count @param {number} samples */
function draw(target, width, height, left, from, columns, count, samples) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.scissor(left, from, columns, count);
    gl.uniform4f(place("iResolution"), width, height, moves && last / 1e3, samples);
    gl.uniform4f(place("iView"), azimuth, elevation, zoom, light);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
}

/** @param {number} now */
function frame(now) {
    isAsked = false;
    if (fence && gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED) return ask();
    const {width, height} = canvas, speed = Math.min(50 / (now - last), 4);
    if (isRough) scale = Math.min(Math.max(scale * Math.sqrt(speed), Math.sqrt(1e3 / width / height)), 1);
    rows = Math.max(isRough ? height * scale * scale / 16 : rows * speed, 1e3 / width); // a piece costs time by itself
    azimuth += turns * 3e-4 * Math.min(now - last, 99);
    last = now;
    isRough = turns || moves || !drawn || isRough && speed > 2 && scale < 1; // fine rows begin once the scale is known
    if (isRough) {
        /** @type {[number, number]} */ const coarse = [Math.ceil(width * scale), Math.ceil(height * scale)];
        draw(buffer, ...coarse, 0, 0, coarse[0] + 1, coarse[1] + 1, 1); // stretching reads one more row and column
        gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
        gl.scissor(0, 0, width, height);
        gl.blitFramebuffer(0, 0, ...coarse, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.LINEAR);
        drawn = 1;
        column = 0;
    } else {
        // Of a long row a part, above and below the middle; 4 samples a pixel where it is fast.
        const columns = Math.ceil(width * Math.min(rows, 1)), count = column ? 1 : Math.ceil(rows);
        for (const from of [drawn - 1, 1 - drawn - count]) {
            draw(null, width, height, column, (height >> 1) + from, columns, count, scale > .3 ? 2 : 1);
        }
        column += columns;
        if (column >= width) {
            drawn += count;
            column = 0;
        }
    }
    fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (drawn < height / 2 + 1) {
        ++steady;
        ask();
    } else steady = 99;
}

function ask() {
    isAsked ||= canvas.isConnected && requestAnimationFrame(frame);
}

function redraw() {
    drawn = 0;
    ask();
}
canvas.addEventListener("webglcontextlost", (event) => {
    if (steady > 50) event.preventDefault(); // asks for another context
    steady = 0;
    stop("the graphics driver failed");
});
canvas.addEventListener("webglcontextrestored", start);
start();

// Controls: one finger or button, or an arrow key, turns; two fingers or the wheel zoom.
/** @type {Map<number, PointerEvent>} */ const fingers = new Map(),
    gap = (/** @type {PointerEvent[]} */ [one, other]) => Math.hypot(one.x - other.x, one.y - other.y);
const zoomBy = (/** @type {number} */ factor) => {
    zoom = Math.min(Math.max(zoom * factor, .3), 20);
    redraw();
};
/** @param {number} x @param {number} y pixels */
function turn(x, y) {
    const angle = 3.14 / Math.min(innerWidth, innerHeight);
    azimuth -= angle * x;
    elevation = Math.min(Math.max(elevation + angle * y, -1.4), 1.4);
    turns = false;
    redraw();
}
onkeydown = ({keyCode}) => { // 37 to 40: left, up, right, down
    if (keyCode > 36 && keyCode < 41) turn(40 * ((38 - keyCode) % 2), 40 * ((39 - keyCode) % 2));
};
canvas.onpointerdown = (/** @type {PointerEvent} */ event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
    turns = false;
};
canvas.onpointerup = canvas.onpointercancel = (/** @type {PointerEvent} */ {pointerId}) => fingers.delete(pointerId);
canvas.onpointermove = (/** @type {PointerEvent} */ event) => {
    const was = fingers.get(event.pointerId), before = [...fingers.values()];
    if (!was) return;
    fingers.set(event.pointerId, event);
    if (before.length > 1) zoomBy(gap([...fingers.values()]) / gap(before));
    else turn(event.x - was.x, event.y - was.y);
};
canvas.onwheel = (/** @type {WheelEvent} */ event) => {
    event.preventDefault();
    zoomBy(Math.exp(-event.deltaY / 500));
};
