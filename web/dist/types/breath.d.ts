/** Lets messages come in: a timer would wait for 4 ms. */
export declare function breath(): Promise<void>;
/** Work on a thread that has others: a turn for whoever waits, after a breath where the turns since the last one have taken long. */
export declare class Turns {
    #private;
    next(): Promise<void>;
}
