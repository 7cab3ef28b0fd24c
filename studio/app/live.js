// The model of a training's weights of this moment, for a picture.

// Returns a model of parseModel with the output's bias as the weight of one more neuron, whose value is 1. Shaders store
// biases of outputs as constants, so that new weights would else need a new shader.
export function withoutOutputBias(model) {
    return {...model, levels: model.levels.map((level) => ({...level, network: withOne(level.network)}))};
}

function withOne(network) {
    const hidden = network.at(-2), output = network.at(-1);
    const longer = (array, ...more) => Float32Array.from([...array, ...more]);
    return [
        ...network.slice(0, -2),
        {
            rows: hidden.rows + 1, columns: hidden.columns,
            weight: longer(hidden.weight, ...new Array(hidden.columns).fill(0)), bias: longer(hidden.bias, Math.PI / 2),
        },
        {rows: 1, columns: output.columns + 1, weight: longer(output.weight, ...output.bias), bias: new Float32Array(1)},
    ];
}
