import type { Changes } from "./module.js";
import type { Attributes, FileAttribute } from "./types.js";
/** What is new of the attributes that are alive; `null` where nothing is. */
export declare function attributesOf(file: readonly FileAttribute[], changes: Changes): Attributes | null;
/** The arrays of numbers by the names of their types. */
export declare const ARRAYS: {
    u8: Uint8ArrayConstructor;
    i8: Int8ArrayConstructor;
    u16: Uint16ArrayConstructor;
    i16: Int16ArrayConstructor;
    u32: Uint32ArrayConstructor;
    i32: Int32ArrayConstructor;
    f32: Float32ArrayConstructor;
};
