// Audio worklet of the microphone: passes the samples on, a block at a time.

class Microphone extends AudioWorkletProcessor {
  process([input]) {
    if (input.length) this.port.postMessage(input[0].slice());
    return true;
  }
}

registerProcessor('microphone', Microphone);
