// What the figures of a report use of Apache ECharts, and no more.
import { init, use } from "echarts/core";
import { CustomChart, LineChart, ScatterChart } from "echarts/charts";
import { DataZoomInsideComponent, GridComponent, LegendComponent, TitleComponent, TooltipComponent } from "echarts/components";
import { LabelLayout } from "echarts/features";
import { SVGRenderer } from "echarts/renderers";

use([
  CustomChart, LineChart, ScatterChart, DataZoomInsideComponent, GridComponent, LegendComponent, TitleComponent, TooltipComponent,
  LabelLayout, SVGRenderer,
]);
globalThis.echarts = { init };
