import {TrainingError} from "../kernel/training_error.js";
import {webm} from "./webm.js";
/** @import {Block} from "./webm.js" */

// A video of one turn as a WebM file. Its frames may take longer to draw than to show, so each gets its own time in the
// file, by WebCodecs. A browser without that records in real time: slow drawing costs frames, not the right speed.
const CODECS = {V_VP9: "vp09.00.51.08", V_VP8: "vp8"};
const BITS_PER_PIXEL = 0.15, KEY_FRAMES_APART = 1; // seconds
const MOST_WAITING = 4; // frames that wait to be encoded

/** drawAt: draws the frame at a share of the turn, from 0 to 1, and resolves in the task that drew it.
 * @typedef {{seconds: number, fps: number, drawAt: (share: number) => Promise<unknown>}} Turn */
/** Called with the share before each frame; "stop" ends the recording. @typedef {(share: number) => string} Tell */

/** Resolves to a Blob, or null where it was stopped. Throws TrainingError where the browser writes no video.
 * @param {HTMLCanvasElement} canvas keeps its size @param {Turn} turn @param {Tell} tell */
export async function recordTurntable(canvas, {seconds, fps, drawAt}, tell) {
    const {width, height} = canvas, bitrate = Math.round(BITS_PER_PIXEL * width * height * fps);
    for (const [name, codec] of globalThis.VideoEncoder ? Object.entries(CODECS) : []) {
        const settings = {codec, width, height, bitrate, framerate: fps};
        if (!(await VideoEncoder.isConfigSupported(settings)).supported) continue;
        const blocks = await encodedFrames(canvas, settings, Math.round(seconds * fps), drawAt, tell);
        return blocks && webm(blocks, {name, width, height, duration: 1000 * seconds});
    }
    return recordedLive(canvas, {seconds, fps, drawAt}, bitrate, tell);
}

/** @param {HTMLCanvasElement} canvas @param {VideoEncoderConfig & {framerate: number}} settings @param {number} count
 * @param {Turn["drawAt"]} drawAt @param {Tell} tell */
async function encodedFrames(canvas, settings, count, drawAt, tell) {
    const blocks = /** @type {Block[]} */ ([]), fps = settings.framerate;
    /** @type {Error | null} */
    let failure = null;
    const encoder = new VideoEncoder({
        output(chunk) {
            const data = new Uint8Array(chunk.byteLength);
            chunk.copyTo(data);
            blocks.push({data, time: Math.round(chunk.timestamp / 1000), isKey: chunk.type === "key"});
        },
        error(error) {
            failure = error;
        },
    });
    encoder.configure(settings);
    try {
        for (let i = 0; i < count; ++i) {
            if (tell(i / count) === "stop") return null;
            await drawAt(i / count);
            const frame = new VideoFrame(canvas, {timestamp: Math.round(1e6 * i / fps)});
            encoder.encode(frame, {keyFrame: i % Math.round(KEY_FRAMES_APART * fps) === 0});
            frame.close();
            while (encoder.encodeQueueSize > MOST_WAITING && !failure) await passed(1);
            if (failure) throw failure;
        }
        await encoder.flush();
        return blocks;
    } finally {
        if (encoder.state !== "closed") encoder.close();
    }
}

/** @param {HTMLCanvasElement} canvas @param {Turn} turn @param {number} bitrate @param {Tell} tell */
async function recordedLive(canvas, {seconds, fps, drawAt}, bitrate, tell) {
    const mimeType = "video/webm", parts = /** @type {Blob[]} */ ([]);
    if (!globalThis.MediaRecorder?.isTypeSupported(mimeType))
        throw new TrainingError("this browser writes no WebM video");
    const stream = canvas.captureStream(0), track = stream.getVideoTracks()[0];
    const recorder = new MediaRecorder(stream, {mimeType, videoBitsPerSecond: bitrate});
    const ended = new Promise((resolve, reject) => {
        recorder.ondataavailable = ({data}) => parts.push(data);
        recorder.onstop = resolve;
        recorder.onerror = ({error}) => reject(error);
    });
    recorder.start();
    let isStopped = false;
    const began = performance.now(), shareNow = () => (performance.now() - began) / 1000 / seconds;
    for (let share = 0; share < 1 && !isStopped; share = shareNow()) {
        isStopped = tell(share) === "stop";
        await drawAt(share);
        const frames = /** @type {{requestFrame(): void}[]} */ (/** @type {unknown} */ ([track, stream]));
        frames.find(({requestFrame}) => requestFrame)?.requestFrame(); // Firefox has it at the stream
        await passed(1000 * (seconds * (share - shareNow()) + 1 / fps));
    }
    recorder.stop();
    await ended;
    return isStopped ? null : new Blob(parts, {type: mimeType});
}

/** @param {number} milliseconds */
function passed(milliseconds) {
    return new Promise((resolve) => {
        setTimeout(resolve, milliseconds);
    });
}
