// networks.cuh: where each network's weights lie in WEIGHTS, for the variants that arrange them in their own way.
struct Layer {
    int rows, columns;  // multiples of 4
    int matrix, bias;   // index of the first texel of each; bias is -1 where it is folded into the matrix
    // Entry of the matrix at row o, column i, and 0 outside it. The matrix lies there as blocks of 4 x 4, one row of
    // blocks after the other, and each block column by column.
    float at(int o, int i) const {
        if (o >= rows || i >= columns) return 0.0f;
        return WEIGHTS[matrix + 4 * (o / 4 * (columns / 4) + i / 4) + i % 4][o % 4];
    }
    float shift(int o) const { return WEIGHTS[bias + o / 4][o % 4]; }
};

struct Network {
    int width;            // of the widest hidden layer, rounded up to a multiple of 16
    int layers, outputs;  // numbers of hidden layers and of outputs
    Layer layer[MOST_LAYERS];
    int row[3];                 // index of the first texel of each output's row
    float scale[3], offset[3];  // output = scale * (row . last sines) + offset
    long long multiply_adds;    // of one evaluation of the value, without padding
};
