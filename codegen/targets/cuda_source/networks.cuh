// networks.cuh: the place of each network's weights in WEIGHTS, for `fused`, which rearranges them.
struct Layer {
    int rows, columns;  // multiples of 4
    int matrix, bias;   // index of the first texel of each; a bias of -1 is a column of the matrix
    // Entry of the matrix at row o, column i; 0 outside. The matrix is stored in blocks of 4 x 4, row by row of blocks,
    // and each block column by column.
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
    long long multiply_adds;    // of one evaluation of the value, without padding
};
