// Frame bytes written by hand from docs/viewer-protocol.md.

export class Bytes {
  private readonly parts: Uint8Array[] = [];

  u32(...values: number[]): this {
    return this.array(Uint32Array.from(values));
  }

  f32(...values: number[]): this {
    return this.array(Float32Array.from(values));
  }

  f64(...values: number[]): this {
    return this.array(Float64Array.from(values));
  }

  array(array: Uint32Array | Float32Array | Float64Array | Uint16Array | Int8Array): this {
    this.parts.push(new Uint8Array(array.buffer, array.byteOffset, array.byteLength), new Uint8Array((4 - (array.byteLength % 4)) % 4));
    return this;
  }

  get buffer(): ArrayBuffer {
    const whole = new Uint8Array(this.parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of this.parts) {
      whole.set(part, at);
      at += part.length;
    }
    return whole.buffer;
  }
}

export function head(format: 1 | 2, counts: readonly [number, number, number, number], status = 0): Bytes {
  return new Bytes()
    .u32(0x46504c50, format, 3, 77)
    .f64(1.25)
    .f32(1, 2, 3, 4, 5, 6, 7, 8, 9, 10)
    .u32(...counts, status, 0);
}
