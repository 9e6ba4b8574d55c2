// The examples of lines of JSON are text as it is sent; Swagger UI takes every media type with `json` in it for JSON, and quotes them.
const linesAsTheyAre = () => ({
  afterLoad() {
    const sample = this.fn.getSampleSchema;
    this.fn.getSampleSchema = (schema, mediaType, config, example) =>
      /ndjson/.test(mediaType) && typeof example === 'string' ? example : sample(schema, mediaType, config, example);
  },
});

window.onload = () => {
  window.ui = SwaggerUIBundle({
    url: '/openapi.json',
    dom_id: '#swagger-ui',
    deepLinking: true,
    presets: [SwaggerUIBundle.presets.apis, SwaggerUIStandalonePreset],
    plugins: [SwaggerUIBundle.plugins.DownloadUrl, linesAsTheyAre],
    layout: 'StandaloneLayout',
  });
};
