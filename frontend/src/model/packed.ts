/** The numbers of a base64 text of little-endian float32. */
export function unpackedFloats(packed: string): Float32Array<ArrayBuffer> {
  const text = atob(packed)
  const bytes = new Uint8Array(text.length)
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k)
  return new Float32Array(bytes.buffer)
}
