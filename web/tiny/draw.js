// The script of a tiny page (web/tiny_page.py). NETWORKS, VIEW, MOVES and SHADER are filled in; `weights` is of
// unpack.js. A network is [type, name, layers, outputs]; a layer [rows, columns, half of its weights, half of its
// biases, step, factors of the input], an output [half, step, offset].

// Returns the next whole numbers of the weights, as web/tiny_page.py writes them: nothing for zeros, one byte each, or
// all high bytes before all low bytes.
let at = 0;
function numbers(count, half) {
    const size = half && 1 + (half > 127), from = at;
    at += size * count;
    const signed = (k) => weights[from + k] << 24 >> 24;
    return Array.from({length: count}, (_, k) => (size > 1 ? 256 * signed(k) + weights[from + count + k] : size && signed(k)));
}

// Returns the sum of products of a layer's rows with the input. rows: 4 gives mat4, 1 gives vec4.
const sum = (matrix, columns, row, rows) => Array.from({length: columns / 4}, (_, i) => {
    const block = Array.from({length: 4 * rows}, (_, k) => matrix[(row + k % rows) * columns + 4 * i + Math.floor(k / rows)]);
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
    const values = outputs.map(([half, step, offset]) => `${step}*(${sum(numbers(width, half), width, 0, 1)})+${offset}`);
    return `${text}return ${type}(${values});}`;
}).join("");

// Draws: coarse pixels in `buffer`, stretched over the canvas, while the view changes; then rows of fine pixels, from the
// top, straight into the canvas. Their numbers follow the device, at some 50 ms for each coarse picture or group of rows.
const canvas = document.createElement("canvas"), gl = canvas.getContext("webgl2", {antialias: false, preserveDrawingBuffer: true});
document.body.append(canvas);
document.body.style.cssText = "margin:9px;overflow:hidden;color-scheme:light dark;color:canvastext;font:13px system-ui;pointer-events:none";
canvas.style.cssText = "position:fixed;inset:0;width:100%;height:100%;z-index:-1;touch-action:none;pointer-events:auto";
if (!gl) document.body.append(" (needs WebGL 2)");
const program = gl.createProgram();
const VERTEX = "#version 300 es\nvoid main(){gl_Position=vec4(gl_VertexID%2*4-1,gl_VertexID/2*4-1,0,1);}";
for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, SHADER.replace("@", functions)]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
}
gl.linkProgram(program);
gl.useProgram(program);
const buffer = gl.createFramebuffer(), pixels = gl.createRenderbuffer(), place = (name) => gl.getUniformLocation(program, name);
gl.bindRenderbuffer(gl.RENDERBUFFER, pixels);
gl.enable(gl.SCISSOR_TEST);
let [azimuth, elevation] = VIEW, zoom = 1, turns = !matchMedia("(prefers-reduced-motion:reduce)").matches;
const moves = MOVES && turns, light = matchMedia("(prefers-color-scheme:light)").matches * .6;
let scale = .2, rows = 9, drawn = 0, last = 0, began = 0, isAsked = false, isRough = true, fence; // drawn: 0, or 1 + fine rows

// Draws rows, from `from` on, of a picture.
function draw(target, width, height, from, count, samples) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(0, 0, width, height);
    gl.scissor(0, from, width, count);
    gl.uniform2f(place("iResolution"), width, height);
    gl.uniform4f(place("V"), azimuth, elevation, zoom, light);
    gl.uniform1f(place("iTime"), moves && last / 1e3);
    gl.uniform1i(place("AA"), samples);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
}

function frame(now) {
    isAsked = false;
    if (fence && gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED) return ask();
    const width = Math.round(innerWidth * devicePixelRatio), height = Math.round(innerHeight * devicePixelRatio);
    const speed = Math.min(50 / (now - began), 4);
    if (isRough) scale = Math.min(Math.max(scale * Math.sqrt(speed), .06), 1);
    else rows = Math.ceil(rows * speed);
    if (canvas.width !== width || canvas.height !== height) {
        canvas.width = width;
        canvas.height = height;
        gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, width, height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, pixels);
        drawn = 0;
    }
    if (turns) azimuth += 3e-4 * Math.min(now - last, 99);
    last = began = now;
    isRough = turns || moves || !drawn;
    if (isRough) {
        const coarse = [Math.ceil(width * scale), Math.ceil(height * scale)];
        draw(buffer, ...coarse, 0, coarse[1], 1);
        gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
        gl.scissor(0, 0, width, height);
        gl.blitFramebuffer(0, 0, ...coarse, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.LINEAR);
        drawn = 1;
    } else {
        draw(null, width, height, height + 1 - drawn - rows, rows, scale > .3 ? 2 : 1); // 4 samples where it is fast
        drawn += rows;
    }
    fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (drawn <= height) ask();
}

function ask() {
    if (!isAsked) requestAnimationFrame(frame);
    isAsked = true;
}

function redraw() {
    drawn = 0;
    ask();
}
onresize = redraw;
redraw();
canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
canvas.addEventListener("webglcontextrestored", () => location.reload());

// Controls: one finger or button turns, two fingers or the wheel zoom.
const fingers = new Map(), gap = ([one, other]) => Math.hypot(one.x - other.x, one.y - other.y);
const zoomBy = (factor) => zoom = Math.min(Math.max(zoom * factor, .3), 20);
canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
    turns = false;
};
canvas.onpointerup = canvas.onpointercancel = ({pointerId}) => fingers.delete(pointerId);
canvas.onpointermove = (event) => {
    const was = fingers.get(event.pointerId), before = [...fingers.values()];
    if (!was) return;
    fingers.set(event.pointerId, event);
    if (before.length > 1) zoomBy(gap([...fingers.values()]) / gap(before));
    else {
        const angle = 3.14 / Math.min(innerWidth, innerHeight);
        azimuth -= angle * (event.x - was.x);
        elevation = Math.min(Math.max(elevation + angle * (event.y - was.y), -1.4), 1.4);
    }
    redraw();
};
canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomBy(Math.exp(-event.deltaY / 500));
    redraw();
}, {passive: false});
