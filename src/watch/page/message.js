// Reads the messages of the feed: src/watch/message.rs describes them.

// Returns the JSON object of a message, with functions that read its arrays by their index.
export function readMessage(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const content = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const starts = [];
  let at = 4 + length;
  for (const size of content.blobs) {
    starts.push(at);
    at += 4 * Math.ceil(size / 4);
  }
  const sizes = content.blobs;
  content.bytes = (index) => new Uint8Array(buffer, starts[index], sizes[index]);
  content.floats = (index) => new Float32Array(buffer, starts[index], sizes[index] / 4);
  content.indices = (index) => new Uint32Array(buffer, starts[index], sizes[index] / 4);
  return content;
}
