/** Progressive triangle meshes (.uwm), decoded in a worker while they arrive. */
export { decode, MeshStream, type DecodeOptions } from "./decode.js";
export { ConnectionError, FormatError, HttpError, LimitError, UnweldError } from "./errors.js";
export { decide, errorOf, levelWithin, type Decision, type Rules, type Standing, type Step } from "./planner.js";
export { WorkerPool } from "./pool.js";
export type { Input, SourceOptions } from "./source.js";
export type { Attributes, Changed, Contents, Delta, FileAttribute, Level, Measure, Metadata, Numbers, NumberType, Residue, Resource, ResourceEntry, ResourceKind, Settings, Until, Wanted, } from "./types.js";
