// What the studio works on, shared by its modules.
export const state = {
    // The shape on the stage, or null: {name, center, scale, up, front, read, crease: of withFacets() (load_shape.js), team:
    // its workers, loading: a promise of when they have it, or null}.
    shape: null,
    // The training under way, or null: {isPaused, isStopped, paused: seconds, live: LivePicture or null}.
    training: null,
    // The last training's result, or null: {levels, texture, settings, seconds, bytes: of the model file, isSaved}.
    result: null,
};

// Returns the shape's numbers for modelFile().
export const factsOfShape = ({name, center, scale, up, front}) => ({name, center, scale, up, front});
