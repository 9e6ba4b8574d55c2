// Reads and writes the raw format of Springline: see docs/formats.md. Nothing is copied: the arrays are views of the bytes received.

const MAGIC = [...'SPRLINE1'].map((c) => c.charCodeAt(0));

/** An answer, given as an ArrayBuffer, with a Float64Array (or Float32Array) for each list of numbers: rows * columns numbers, row by row. */
export function decode(buffer) {
  const bytes = new Uint8Array(buffer);
  if (MAGIC.some((byte, i) => bytes[i] !== byte)) throw new Error('not the raw format');
  const start = 16 + new DataView(buffer).getUint32(8, true);
  const view = (Numbers, [from, rows, columns]) => new Numbers(buffer, start + from * Numbers.BYTES_PER_ELEMENT, rows * (columns || 1));
  return JSON.parse(new TextDecoder().decode(bytes.subarray(16, start)), (_, value) =>
    value?.$f64 ? view(Float64Array, value.$f64) : value?.$f32 ? view(Float32Array, value.$f32) : value);
}

/** A request body: like JSON.stringify, but each list made by points(array, columns) is sent as numbers. */
export function encode(request) {
  const lists = [];
  let count = 0;
  const text = JSON.stringify(request, (_, value) => {
    if (!(value instanceof Points)) return value;
    lists.push(value.numbers);
    count += value.numbers.length;
    return { $f64: [count - value.numbers.length, value.numbers.length / (value.columns || 1), value.columns] };
  });
  const header = new TextEncoder().encode(text);
  const start = 16 + Math.ceil(header.length / 8) * 8;
  const bytes = new Uint8Array(start + 8 * count);
  bytes.set(MAGIC);
  new DataView(bytes.buffer).setUint32(8, start - 16, true);
  bytes.fill(32, 16, start).set(header, 16);
  const numbers = new Float64Array(bytes.buffer, start);
  lists.reduce((at, list) => (numbers.set(list, at), at + list.length), 0);
  return bytes;
}

class Points { constructor(numbers, columns) { this.numbers = numbers; this.columns = columns; } }
export const points = (numbers, columns) => new Points(numbers, columns);
