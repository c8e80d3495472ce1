// Blocks of sound of the stand-in: a tone of 440 Hz with the amplitude 0.25.

const RATE = 48000;

/** Sends the tone by the clock, some milliseconds at a time; returns the timer. */
export function playTone({ socket }, generation) {
  const begun = performance.now();
  let sent = 0;
  const timer = setInterval(() => {
    const count = Math.floor(((performance.now() - begun) / 1000) * RATE) - sent;
    if (count <= 0) return;
    const block = Buffer.alloc(16 + 4 * count);
    [0x53504c50, generation, RATE, count].forEach((number, at) => block.writeUInt32LE(number, 4 * at));
    for (let at = 0; at < count; at++) block.writeFloatLE(0.25 * Math.sin((2 * Math.PI * 440 * (sent + at)) / RATE), 16 + 4 * at);
    sent += count;
    socket.send(block);
  }, 4);
  timer.unref();
  return timer;
}
