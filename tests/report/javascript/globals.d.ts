declare const Bokeh: any;
